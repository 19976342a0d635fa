"""The calibrated machine in memory: the one that its file, read again, is.

What was found, bands and correlations included, is worked out once for both, `CalibratedValues`.
Only a direction is told in another way: a file has its new axis, a machine in memory the deviation
from the axis that it had. It points the same way; the two angles of its band count about the old
axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.result.bands import Banded
from truepose.calibration.result.file import (
    AT,
    DEFAULT_COVERAGE,
    CalibratedValues,
    MachineUnknowns,
    require_determined,
    variable_names,
)
from truepose.machine import Machine
from truepose.machine.source_builder import ErrorSource
from truepose.probability.distributions import UNIFORM, Distribution, normal
from truepose.sources import REGISTRY
from truepose.sources.deviation import OWN_GROUP, Deviation, GroupQuantity
from truepose.sources.tolerance import EDGE_ENDINGS, DimensionalTolerance
from truepose.sources.variation import WITH_MACHINE, Variation


def calibrated_machine(
    machine: Machine,
    unknowns: MachineUnknowns,
    values: Floats,
    covariance: Floats,
    *,
    coverage: float = DEFAULT_COVERAGE,
) -> Machine:
    """The machine whose nominal geometry and bands are those found, with a controller to match.

    `values` (n,) and `covariance` (n, n) of the unknowns, SI; those of instruments are not read.
    `coverage`: half bands in standard deviations. Raises `RequestError` (calibration-undetermined).
    """
    own_values = np.asarray(values, np.float64)[: unknowns.n_machine]
    own_covariance = np.asarray(covariance, np.float64)[: unknowns.n_machine, : unknowns.n_machine]
    require_determined(machine.file, unknowns, own_values, own_covariance)
    result = CalibratedValues.of(
        machine, unknowns, own_values, own_covariance, "calibrated", new_axes=False
    )
    found = machine
    for number, identified in unknowns.properties.items():
        found = identified.changed(found, float(own_values[number])) or found
    # A family's parameters move what keeps its own tolerance.
    others = np.flatnonzero(result.nominal != machine.nominal)
    columns = np.union1d(result.moved, others)
    names = [machine.parameters[column] for column in columns]
    nominal = result.nominal[columns].tolist()
    found = found.replace(dict(zip(names, nominal, strict=True)))
    asked = machine.accuracy
    if asked.at is None and (asked.target is not None or asked.angle_target is not None):
        asked = replace(asked, at=AT)
    return replace(
        found,
        family=result.family,
        sources=_sources(machine, result, coverage),
        accuracy=asked,
        controller_holds="calibrated",
    )


def _sources(
    machine: Machine, result: CalibratedValues, coverage: float
) -> tuple[ErrorSource, ...]:
    """Those of the machine, the tolerances with the bands of the result."""
    bands = _bands(machine, result, coverage)
    by_kind: dict[type, ErrorSource] = {type(source): source for source in machine.sources}
    if bands.parameters.size:
        by_kind[DimensionalTolerance] = DimensionalTolerance(bands)
    return tuple(by_kind[kind] for kind in REGISTRY if kind in by_kind)


class _Column(NamedTuple):
    """A column of a deviation: its parameter, its band, the group that it varies with.

    `variable`: whose it was, of the file's bands or of those found, and its number there.
    """

    parameter: int
    shift: float
    half: float
    group: str | None
    sign: float
    distribution: Distribution
    variable: tuple[str, int]
    variation: Variation = WITH_MACHINE


_FILED, _FOUND = "filed", "found"


def _bands(machine: Machine, result: CalibratedValues, coverage: float) -> Deviation:
    """The file's bands of what was not identified, and those found, in the parameters' order."""
    filed = [] if result.forgotten is None else _filed(result.forgotten)
    moved = set(result.moved.tolist())
    banded = set(result.bands.columns.tolist())
    columns = [column for column, stays in zip(filed, result.kept, strict=True) if stays]
    columns += [  # what was found without any uncertainty
        column._replace(
            shift=0.0,
            half=0.0,
            group=None,
            sign=1.0,
            distribution=UNIFORM,
            variation=WITH_MACHINE,
        )
        for column, stays in zip(filed, result.kept, strict=True)
        if not stays and column.parameter in moved - banded
    ]
    columns += _found(machine, result.bands, coverage)
    # As a file's are: the parameters' own first, then what the family's parameters move.
    family = () if machine.family is None else machine.family.names
    columns.sort(
        key=lambda column: (
            family.index(column.group) if column.group in family else -1,
            column.parameter,
        )
    )
    groups = list(dict.fromkeys(column.group for column in columns if column.group is not None))
    names = machine.parameters
    bands = Deviation.of(
        [column.parameter for column in columns],
        [column.shift for column in columns],
        [column.half for column in columns],
        groups=[
            OWN_GROUP if column.group is None else groups.index(column.group) for column in columns
        ],
        sign=[column.sign for column in columns],
        edge=[names[column.parameter].endswith(EDGE_ENDINGS) for column in columns],
        distribution=[column.distribution for column in columns],
        variation=[column.variation for column in columns],
        group_names=dict(enumerate(groups)),
        group_quantities={
            groups.index(name): quantity
            for name, quantity in _quantities(result, coverage).items()
            if name in groups
        },
    )
    return replace(bands, correlation=_correlation(bands, columns, result))


def _quantities(result: CalibratedValues, coverage: float) -> dict[str, GroupQuantity]:
    """Of the family's parameters that have a band: as filed, or as found."""
    old, bands = result.forgotten, result.bands
    quantities = (
        {} if old is None else {old.group_names[n]: q for n, q in old.group_quantities.items()}
    )
    for variable in bands.of_family():
        name = bands.names[variable]
        assert result.family is not None
        half = coverage * float(bands.deviations[variable])
        quantities[name] = GroupQuantity(0.0, half, result.family.unit(name))
    return quantities


def _filed(old: Deviation) -> list[_Column]:
    """The columns of the file's bands."""
    return [
        _Column(
            int(parameter),
            float(old.shift[0, at]),
            float(old.half[0, at]),
            old.group_names.get(int(old.groups[at])),
            float(old.sign[0, at]),
            old.distribution[at],
            (_FILED, int(old.variables[at])),
            old.variation[at],
        )
        for at, parameter in enumerate(old.parameters)
    ]


def _found(machine: Machine, bands: Banded, coverage: float) -> Iterator[_Column]:
    """The columns of what was found: normal, each moved by its one variable."""
    called = variable_names(machine, bands)
    for parameter, effects in zip(bands.columns.tolist(), bands.effects, strict=True):
        for variable in np.flatnonzero(effects).tolist():
            effect = float(effects[variable])
            group = called[variable] if bands.names[variable] else None
            sign = -1.0 if group is not None and effect < 0.0 else 1.0
            half = coverage * abs(effect)
            yield _Column(parameter, 0.0, half, group, sign, normal(coverage), (_FOUND, variable))


def _correlation(
    bands: Deviation, columns: Sequence[_Column], result: CalibratedValues
) -> Floats | None:
    """(n_variable, n_variable) of the variables of `bands`; None where all are independent."""
    given = {_FOUND: result.bands.correlation}
    if result.forgotten is not None and result.forgotten.correlation is not None:
        given[_FILED] = result.forgotten.correlation
    matrix = np.eye(bands.n_variable)
    for origin, correlation in given.items():
        number = {
            column.variable[1]: int(bands.variables[at])
            for at, column in enumerate(columns)
            if column.variable[0] == origin and column.half > 0.0
        }
        old, new = list(number), list(number.values())
        matrix[np.ix_(new, new)] = correlation[np.ix_(old, old)]
    return None if np.array_equal(matrix, np.eye(len(matrix))) else matrix
