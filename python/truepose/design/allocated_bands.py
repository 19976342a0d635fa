"""The bands of a machine with those that are to be chosen taken out, and put in again.

What a band of the file says besides its width stays: its middle, its distribution, what it varies
with, and the group that it is in. A family's parameter moves several of the machine's.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.files.tolerance import LISTED
from truepose.machine import Machine
from truepose.machine.families.parameters import is_of_family
from truepose.sources.deviation import OWN_GROUP, UNIFORM, Deviation, GroupQuantity
from truepose.sources.tolerance import EDGE_ENDINGS, DimensionalTolerance, bands_of
from truepose.sources.variation import WITH_MACHINE


@dataclass(frozen=True, eq=False)
class AllocatedBands:
    """The features of a design among the bands of a machine.

    `fixed`: the machine with bands of no width for them, their middles kept. `columns` (k,): kernel
    parameters that they move, `feature_of` (k,) which feature moves each and `slopes` (k,) by how
    much. `variable_of` (f,): which variable the feature follows, features of one group the same.
    `template`: the bands with all of them in, and the `places` (k,) in it of the columns.
    """

    machine: Machine
    fixed: Machine
    features: tuple[str, ...]
    columns: Indices
    feature_of: Indices
    slopes: Floats
    variable_of: Indices
    template: Deviation
    places: Indices

    @property
    def member(self) -> Floats:
        """(f, v) 1 where a feature follows a variable."""
        count = int(self.variable_of.max(initial=-1)) + 1
        member = np.zeros((len(self.features), count))
        member[np.arange(len(self.features)), self.variable_of] = 1.0
        return member

    @property
    def filed(self) -> Floats:
        """(f,) half widths that the file has; 0 of what has no band in it."""
        half = np.zeros(len(self.features))
        own = self.template.half[0, self.places]
        np.maximum.at(half, self.feature_of, own / np.abs(self.slopes))
        return half

    def bands(self, halves: Floats) -> Deviation:
        """All bands with half widths (f,) of the features, SI."""
        half = self.template.half.copy()
        half[:, self.places] = np.abs(self.slopes) * halves[self.feature_of]
        quantities = dict(self.template.group_quantities)
        for number, one in quantities.items():
            name = self.template.group_names.get(number, "")
            if name in self.features:
                at = self.features.index(name)
                quantities[number] = one._replace(half=float(halves[at]))
        return dataclasses.replace(self.template, half=half, group_quantities=quantities)

    def designed(self, halves: Floats) -> Machine:
        """The machine with half widths (f,) of the features, SI."""
        return _with_bands(self.machine, self.bands(halves))


def allocated_bands(
    machine: Machine, features: Sequence[str], tie_of: Sequence[int]
) -> AllocatedBands:
    """The features' bands of a machine; `tie_of` (f,): which tie each is in.

    Raises `RequestError` (bad-allocation): a band of listed values, or a group of which only a part
    is to be chosen, or which is in two ties.
    """
    bands = bands_of(machine) or Deviation.of([], distribution=[])
    template, placed = _with_all(machine, bands, features)
    columns, feature_of, slopes, places = [], [], [], []
    for feature, (place, slope) in enumerate(placed):
        columns += template.parameters[place].tolist()
        feature_of += [feature] * len(place)
        slopes += slope
        places += place
    result = AllocatedBands(
        machine,
        machine,
        tuple(features),
        np.array(columns, np.intp),
        np.array(feature_of, np.intp),
        np.array(slopes, np.float64),
        _variables(template, placed),
        template,
        np.array(places, np.intp),
    )
    _require_whole(machine, result, tie_of)
    fixed = _with_bands(machine, result.bands(np.zeros(len(features))))
    return dataclasses.replace(result, fixed=fixed)


_Placed = list[tuple[list[int], list[float]]]
"""Of each feature: places of its columns among the bands, and by how much each moves."""


def _with_all(
    machine: Machine, bands: Deviation, features: Sequence[str]
) -> tuple[Deviation, _Placed]:
    """The bands with a column, of no width, for every feature that has none."""
    parameters, half, groups, edge = [], [], [], []
    names, quantities = dict(bands.group_names), dict(bands.group_quantities)
    shift, sign = bands.shift[0].tolist(), bands.sign[0].tolist()
    distributions, variations = list(bands.distribution), list(bands.variation)
    parameters += bands.parameters.tolist()
    half += bands.half[0].tolist()
    groups += bands.groups.tolist()
    edge += bands.edge.tolist()
    known = len(parameters)
    placed: _Placed = []
    for feature in features:
        moved = _moved(machine, feature)
        own = _places(bands, feature, list(moved))
        if not own:
            own = list(range(len(parameters), len(parameters) + len(moved)))
            group = OWN_GROUP
            if is_of_family(feature):
                group = max([*groups, *names, -1]) + 1
                names[group] = feature
                assert machine.family is not None
                quantities[group] = GroupQuantity(0.0, 0.0, machine.family.unit(feature))
            for parameter, slope in moved.items():
                parameters.append(parameter)
                half.append(0.0)
                shift.append(0.0)
                sign.append(float(np.copysign(1.0, slope)))
                groups.append(group)
                edge.append(machine.parameters[parameter].endswith(EDGE_ENDINGS))
                distributions.append(UNIFORM)
                variations.append(WITH_MACHINE)
        # A group's member goes by its sign; of a family's parameter the slope has it.
        slopes = [
            moved[parameters[place]] * (1.0 if is_of_family(feature) else _sign(bands, place))
            for place in own
        ]
        placed.append((own, slopes))
    correlation = bands.correlation
    if correlation is not None and len(parameters) > known:
        correlation = _extended(bands, parameters, groups)
    every = Deviation.of(
        parameters,
        shift,
        half,
        groups=groups,
        sign=sign,
        edge=edge,
        distribution=distributions,
        correlation=correlation,
        group_names=names,
        group_quantities=quantities,
        variation=variations,
    )
    return every, placed


def _moved(machine: Machine, feature: str) -> dict[int, float]:
    """Parameters that a feature moves, and by how much."""
    if not is_of_family(feature):
        return {machine.parameters.index(feature): 1.0}
    assert machine.family is not None
    effects = machine.family.effects(feature)
    return {machine.parameters.index(name): slope for name, slope in effects.items()}


def _places(bands: Deviation, feature: str, parameters: list[int]) -> list[int]:
    """The columns that a feature has among the bands."""
    if is_of_family(feature):
        numbers = [number for number, name in bands.group_names.items() if name == feature]
        of_quantity = [number for number in numbers if number in bands.group_quantities]
        return [int(at) for at in np.flatnonzero(np.isin(bands.groups, of_quantity))]
    own = np.isin(bands.parameters, parameters) & ~bands.of_quantities
    return [int(at) for at in np.flatnonzero(own)]


def _sign(bands: Deviation, place: int) -> float:
    if place >= bands.parameters.size or bands.groups[place] == OWN_GROUP:
        return 1.0
    return float(bands.sign[0, place])


def _extended(bands: Deviation, parameters: Sequence[int], groups: Sequence[int]) -> Floats:
    """The correlation, with independent variables for what is new."""
    assert bands.correlation is not None
    every = Deviation.of(parameters, groups=groups, distribution=UNIFORM, sign=1.0).variables
    old = every[: bands.parameters.size]
    correlation = np.eye(int(every.max()) + 1)
    # Variables are numbered anew: a group that is new stands before those of single columns.
    number = np.zeros(bands.n_variable, np.intp)
    number[bands.variables] = old
    correlation[np.ix_(number, number)] = bands.correlation
    return correlation


def _variables(template: Deviation, placed: _Placed) -> Indices:
    """(f,) which variable each feature follows, numbered from 0 in their order."""
    first = [int(template.variables[places[0]]) for places, _ in placed]
    numbers = {variable: at for at, variable in enumerate(dict.fromkeys(first))}
    return np.array([numbers[variable] for variable in first], np.intp)


def _require_whole(machine: Machine, bands: AllocatedBands, tie_of: Sequence[int]) -> None:
    """Raise `RequestError` (bad-allocation) for groups in part, and listed values."""
    template, problems = bands.template, []
    for place, feature in zip(bands.places.tolist(), bands.feature_of.tolist(), strict=True):
        distribution = template.distribution[place]
        if distribution.name in LISTED:
            problems.append((bands.features[feature], f"{distribution}", "a band of some width"))
    for number, name in template.group_names.items():
        members = np.flatnonzero(template.groups == number)
        chosen = np.isin(members, bands.places)
        if not chosen.any():
            continue
        ties = {
            tie_of[feature]
            for place, feature in zip(bands.places, bands.feature_of, strict=True)
            if place in members
        }
        if not chosen.all() or len(ties) > 1:
            shown = f"{int(chosen.sum())} of {members.size} members, in {len(ties)} ties"
            problems.append((name, shown, "all members of a group in one tie"))
    if problems:
        raise RequestError(
            *(
                Problem(
                    "bad-allocation",
                    f"{name}: its width cannot be chosen by itself",
                    machine.file,
                    path="cost.tolerance",
                    found=shown,
                    expected=expected,
                )
                for name, shown, expected in dict.fromkeys(problems)
            )
        )


def _with_bands(machine: Machine, bands: Deviation) -> Machine:
    """The machine with other bands of its tolerances, its first source if it has none."""
    source = DimensionalTolerance(bands)
    tolerance = [isinstance(one, DimensionalTolerance) for one in machine.sources]
    sources = tuple(
        source if own else one for one, own in zip(machine.sources, tolerance, strict=True)
    )
    return dataclasses.replace(machine, sources=sources if any(tolerance) else (source, *sources))


__all__ = ["AllocatedBands", "allocated_bands"]
