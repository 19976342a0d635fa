"""What is to be found: variables of the tolerances, further parameters, properties, instruments.

An unknown moves parameters in proportion to itself. One of a tolerance is the tolerance's own
variable, be it one parameter's or a group's, in the unit of the parameter that it moves most; one
of the family (`family.radius`) is that parameter's own change. The band about it is what is known
beforehand:

    mean = shift,  standard deviation = half / sigmas,  correlations as the file states them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.identification.properties import Property, properties_of
from truepose.calibration.instruments._base import Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import UNITS, column_name, is_parameter
from truepose.errors import ArgumentError, Problem, RequestError
from truepose.files.shown_units import METRIC, ShownUnits
from truepose.files.units import QuantityError, UnitSystem
from truepose.files.wording import did_you_mean
from truepose.machine import Machine
from truepose.machine.families.parameters import is_of_family
from truepose.machine.parts import gives_way_only
from truepose.representation import Facts, Represented
from truepose.sources import Deviation
from truepose.sources.tolerance import bands_of
from truepose.sources.variation import WITH_MACHINE

SCREEN = 1e-9
"""Middles of a group's bands may be this far, of its half band, from moving together."""


@dataclass(frozen=True, eq=False, repr=False)
class Unknowns(Represented):
    """What is to be found, n numbers in SI; the first `n_machine` are the machine's.

    `names`, `units` and `labels` (for people). `columns` (k,): parameters that machine unknowns
    move, each by `effects` (k, n) times the unknown's value; the largest effect of an unknown is
    +-1, but for a parameter of the family, whose effects are its derivatives. Properties have none
    there: what they move differs from row to row. `prior_mean` (n,), `prior_covariance` (n, n):
    infinite on the diagonal where nothing is known beforehand. `half` (n,): half bands, infinite
    likewise. `properties`: by the number of their unknown.
    `readings`: of each unknown bias what it is added to, (instrument, observable, strut or -1).
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    labels: tuple[str, ...]
    n_machine: int
    columns: Indices
    effects: Floats
    prior_mean: Floats
    prior_covariance: Floats
    half: Floats
    properties: dict[int, Property] = dataclasses.field(default_factory=dict)
    frames: dict[int, tuple[int | None, ...]] = dataclasses.field(default_factory=dict)
    """Of each instrument the unknowns of its origin x y z, rotation x y z and target x y z."""
    biases: dict[tuple[int, int, int], int] = dataclasses.field(default_factory=dict)
    """(instrument, observable, strut) -> the unknown that is added to the reading."""
    shown: ShownUnits = METRIC
    """The units in which people are told of them."""

    def _facts(self) -> Facts:
        yield "unknowns", self.count
        yield "of the machine", self.n_machine
        yield "with a tolerance", int(self.has_prior.sum())
        yield "names", ", ".join(self.names)

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.names)

    @property
    def has_prior(self) -> np.ndarray:
        """(n,) of which something is known beforehand."""
        flags: np.ndarray = np.isfinite(np.diagonal(self.prior_covariance))
        return flags

    def known_beforehand(self, *, tolerances: bool) -> Floats:
        """(n, n) covariance of what is known beforehand, infinite where nothing is.

        What is known of the instruments stays known where `tolerances` do not count.
        """
        covariance = self.prior_covariance.copy()
        if not tolerances:
            covariance[: self.n_machine] = covariance[:, : self.n_machine] = 0.0
            own = np.arange(self.n_machine)
            covariance[own, own] = np.inf
        return covariance

    def parameter_change(self, values: Floats) -> Floats:
        """(k,) by how much the parameters `columns` differ from nominal, for values (n,)."""
        change: Floats = self.effects @ values
        return change

    def nominal_sizes(self, machine: Machine) -> Floats:
        """(n_machine,) the size that an unknown changes: of one parameter, or of equal ones, SI.

        NaN for what moves several that differ, such as the coordinates of a radius, and for
        properties.
        """
        sizes = np.full(self.n_machine, np.nan)
        for number in range(self.n_machine):
            rows = np.flatnonzero(self.effects[:, number])
            nominal = machine.nominal[self.columns[rows]]
            if machine.family is not None and self.names[number] in machine.family.names:
                sizes[number] = machine.family.value(self.names[number])
                continue
            # Rods that are equal are one number for people, coordinates that move apart are not.
            alike = rows.size and (self.effects[rows, number] == 1.0).all()
            if alike and np.ptp(nominal) <= 1e-9 * np.abs(nominal).max():
                sizes[number] = nominal[0]
        return sizes


@dataclass(frozen=True)
class _MachineUnknown:
    """One unknown of the machine, before all are put together."""

    name: str
    unit: str
    label: str
    effects: dict[int, float]
    mean: float
    sigma: float
    half: float
    variable: int | None = None
    property: Property | None = None


def unknowns_of(
    machine: Machine, measurements: Measurements, identify: Sequence[str] = ()
) -> Unknowns:
    """The unknowns of a machine and of the instruments that measured it.

    `identify`: names, groups or patterns (`strut.*.length`), each with a half band of its own where
    one is given (`strut.*.expansion=2e-6 1/K`, `strut.1.length=0.5 mm`); nothing: everything that
    has a tolerance. What is named without having a tolerance, and without a band, is found from the
    measurements alone. Parameters that were measured by themselves are always among them.

    Raises `RequestError` (unknown-parameter, no-unknowns, bad-band, no-stiffness, bad-prior).
    """
    bands = bands_of(machine)
    tolerated = _tolerance_unknowns(machine, bands)
    wanted = _with_measured(
        machine, measurements, tolerated, _chosen_unknowns(machine, tolerated, identify, bands)
    )
    if not wanted:
        raise RequestError(
            Problem(
                "no-unknowns",
                "there is nothing to identify: no parameter has a tolerance, and none is named",
                machine.file,
                found="no [tolerance] and no name",
                expected="tolerances in the machine file, or names of parameters to identify",
                hint='--identify "strut.*.length"',
            )
        )
    columns = sorted({column for unknown in wanted for column in unknown.effects})
    place = {column: at for at, column in enumerate(columns)}
    instruments = _instrument_unknowns(machine, measurements, len(wanted))
    count = len(wanted) + len(instruments.names)
    effects = np.zeros((len(columns), count))
    covariance = np.diag(np.full(count, np.inf))
    for number, unknown in enumerate(wanted):
        for column, effect in unknown.effects.items():
            effects[place[column], number] = effect
        covariance[number, number] = unknown.sigma**2
    if bands is not None and bands.correlation is not None:
        _correlate(covariance, wanted, bands)
    for number, uncertainty in instruments.uncertainties.items():
        covariance[number, number] = uncertainty**2
    extra = len(instruments.names)
    return Unknowns(
        tuple(unknown.name for unknown in wanted) + tuple(instruments.names),
        tuple(unknown.unit for unknown in wanted) + tuple(instruments.units),
        tuple(unknown.label for unknown in wanted) + tuple(instruments.labels),
        len(wanted),
        np.array(columns, np.intp),
        effects,
        np.array([unknown.mean for unknown in wanted] + [0.0] * extra),
        covariance,
        np.array([unknown.half for unknown in wanted] + [np.inf] * extra),
        {at: unknown.property for at, unknown in enumerate(wanted) if unknown.property is not None},
        instruments.frames,
        instruments.biases,
        machine.shown,
    )


def unknowns_of_instruments(machine: Machine, measurements: Measurements) -> Unknowns:
    """Those of the instruments alone; the machine stays as its file has it."""
    own = _instrument_unknowns(machine, measurements, 0)
    count = len(own.names)
    covariance = np.diag(np.full(count, np.inf))
    for number, uncertainty in own.uncertainties.items():
        covariance[number, number] = uncertainty**2
    return Unknowns(
        tuple(own.names),
        tuple(own.units),
        tuple(own.labels),
        0,
        np.empty(0, np.intp),
        np.empty((0, count)),
        np.zeros(count),
        covariance,
        np.full(count, np.inf),
        frames=own.frames,
        biases=own.biases,
        shown=machine.shown,
    )


def _tolerance_unknowns(machine: Machine, bands: Deviation | None) -> list[_MachineUnknown]:
    """One unknown for each variable that has a band, in the order of the parameters.

    What varies with each run or visit is no number to be found.
    """
    if bands is None:
        return []
    unknowns = []
    half_width, shift = bands.signed_half[0], bands.shift[0]
    steady = [at for at in bands.banded if bands.variation[at] == WITH_MACHINE]
    for variable in dict.fromkeys(bands.variables[steady].tolist()):
        members = np.flatnonzero(bands.variables == variable)
        leader = members[np.argmax(np.abs(half_width[members]))]
        number = int(bands.groups[leader])
        group, quantity = bands.group_names.get(number), bands.group_quantities.get(number)
        half = float(abs(half_width[leader])) if quantity is None else quantity.half
        effects = half_width[members] / half
        mean = float(shift[leader] * np.sign(effects[members == leader][0]))
        if quantity is not None:
            mean = quantity.shift
        if np.abs(shift[members] - effects * mean).max() > SCREEN * half:
            raise RequestError(
                Problem(
                    "bad-prior",
                    f"the middles of the bands of group {group!r} do not move as the group does",
                    machine.file,
                    path="tolerance",
                    found="middles that differ",
                    expected="symmetric bands, or middles in the ratio of the half bands",
                )
            )
        parameter = int(bands.parameters[leader])
        name = machine.parameters[parameter] if group is None else group
        unknowns.append(
            _MachineUnknown(
                name,
                machine.units[parameter] if quantity is None else quantity.unit,
                label_of(name) if group is None or quantity is not None else group,
                dict(zip(bands.parameters[members].tolist(), effects.tolist(), strict=True)),
                mean,
                half / bands.distribution[leader].sigmas,
                half,
                int(variable),
            )
        )
    return unknowns


def _chosen_unknowns(
    machine: Machine,
    tolerated: Sequence[_MachineUnknown],
    identify: Sequence[str],
    bands: Deviation | None,
) -> list[_MachineUnknown]:
    if not identify:
        return list(tolerated)
    known: dict[str, _MachineUnknown] = {}
    for name, unit, column in zip(
        machine.parameters, machine.units, range(len(machine.parameters)), strict=True
    ):
        if not gives_way_only(name):
            known[name] = _MachineUnknown(
                name, unit, label_of(name), {column: 1.0}, 0.0, np.inf, np.inf
            )
    family = machine.family
    for name in () if family is None else family.names:
        assert family is not None
        effects = {
            machine.parameters.index(moved): effect
            for moved, effect in family.effects(name).items()
        }
        known[name] = _MachineUnknown(
            name, family.unit(name), label_of(name), effects, 0.0, np.inf, np.inf
        )
    for name, identifiable in properties_of(machine).items():
        unit, label = identifiable.unit, identifiable.label(machine)
        known[name] = _MachineUnknown(
            name, unit, label, {}, 0.0, np.inf, np.inf, None, identifiable
        )
    # A member of a group stands for its group: one cannot move without the other.
    of_group = {
        machine.parameters[column]: unknown.name
        for unknown in tolerated
        if not is_of_family(unknown.name)
        for column in unknown.effects
    }
    known |= {unknown.name: unknown for unknown in tolerated}
    unsteady = {} if bands is None else _varying(machine, bands)
    chosen: dict[str, _MachineUnknown] = {}
    problems = []
    for text in identify:
        if not isinstance(text, str):
            raise ArgumentError.of("identify", text, 'names, such as ["strut.*.length"]')
        pattern, _, band = (part.strip() for part in text.partition("="))
        if pattern in known:
            names = [pattern]
        else:
            names = [name for name in known if _matches(name, pattern)]
        if not names:
            problems.append(_no_parameter(machine, pattern, known))
        for name in dict.fromkeys(of_group.get(name, name) for name in names):
            try:
                chosen[name] = _with_band(machine, known[name], band)
            except QuantityError as error:
                problems.append(
                    Problem(
                        "bad-band",
                        f"the half band of {name} cannot be read: {error.message}",
                        path=name,
                        found=band,
                        expected=f"a positive quantity in a unit of {known[name].unit}",
                        hint=error.hint,
                    )
                )
                break
        for name in names:
            wanted = known[of_group.get(name, name)].property
            if wanted is not None and wanted.changed(machine, 0.0) is None:
                problems.append(_no_stiffness(machine, name))
            elif name in unsteady:
                problems.append(_unsteady(machine, name, unsteady[name]))
    if problems:
        raise RequestError(*problems)
    order = {
        name: at for at, name in enumerate([unknown.name for unknown in tolerated] + list(known))
    }
    return sorted(chosen.values(), key=lambda unknown: order[unknown.name])


def _varying(machine: Machine, bands: Deviation) -> dict[str, str]:
    """Parameters, and groups, whose tolerance is another in every run or visit, and in which."""
    words: dict[str, str] = {}
    for at in bands.banded.tolist():
        if bands.variation[at] != WITH_MACHINE:
            group = bands.group_names.get(int(bands.groups[at]))
            name = machine.parameters[int(bands.parameters[at])]
            words |= dict.fromkeys([name, group or name], bands.variation[at].word)
    return words


def _unsteady(machine: Machine, name: str, word: str) -> Problem:
    return Problem(
        "bad-prior",
        f"{name} is another number in every {word}: there is not one to be found",
        machine.file,
        path=name,
        found=f'a tolerance with varies = "{word}"',
        expected="parameters that stay as they are",
        hint="leave it out of what is identified; readings repeated at a pose show such a spread",
    )


def _matches(name: str, pattern: str) -> bool:
    """Of a family's parameters a pattern names all limbs together, `family.*`, or each its own."""
    if is_of_family(name) and not (is_of_family(pattern) and pattern.count(".") == name.count(".")):
        return False
    return fnmatchcase(name, pattern)


def _with_measured(
    machine: Machine,
    measurements: Measurements,
    tolerated: Sequence[_MachineUnknown],
    chosen: list[_MachineUnknown],
) -> list[_MachineUnknown]:
    """And the parameters that were measured by themselves, or the groups that they are of."""
    fitted = ~measurements.held_out[measurements.row]
    measured = np.unique(measurements.strut[is_parameter(measurements.observable) & fitted])
    moved = {column for unknown in chosen for column in unknown.effects}
    for column in measured.tolist():
        if column in moved:
            continue
        name, unit = machine.parameters[column], machine.units[column]
        alone = _MachineUnknown(name, unit, label_of(name), {column: 1.0}, 0.0, np.inf, np.inf)
        grouped = (one for one in tolerated if not is_of_family(one.name))
        unknown = next((one for one in grouped if column in one.effects), alone)
        moved.update(unknown.effects)
        chosen = [*chosen, unknown]
    return chosen


_DIMENSION_OF_UNIT = {"m": "length", "rad": "angle", "1/K": "expansion", "1": "ratio"}


def _with_band(machine: Machine, wanted: _MachineUnknown, band: str) -> _MachineUnknown:
    """The unknown with a half band of its own, uniform. Raises `QuantityError`."""
    if not band:
        return wanted
    half = UnitSystem(machine.file_units).read(band, _DIMENSION_OF_UNIT[wanted.unit])
    if not (np.isfinite(half) and half > 0.0):
        raise QuantityError("not-positive", "a half band is above zero", found=band)
    return dataclasses.replace(wanted, half=half, sigma=half / np.sqrt(3.0), variable=None)


def _no_parameter(machine: Machine, pattern: str, known: Iterable[str]) -> Problem:
    return Problem(
        "unknown-parameter",
        f"nothing that can be identified is called {pattern}",
        machine.file,
        path=pattern,
        found=pattern,
        expected="a parameter, a group of tolerances, a pattern over them, strut.<name>.expansion "
        "or strut.<name>.compliance",
        hint=did_you_mean(pattern, list(known)),
    )


def _no_stiffness(machine: Machine, name: str) -> Problem:
    return Problem(
        "no-stiffness",
        f"{name} is a relative change, and nothing says how stiff the strut is",
        machine.file,
        path=name.rpartition(".")[0],
        found="no stiffness",
        expected="stiffness, or modulus and section_area, of the strut, to start from",
    )


def _correlate(covariance: Floats, wanted: Sequence[_MachineUnknown], bands: Deviation) -> None:
    assert bands.correlation is not None
    for i, first in enumerate(wanted):
        for j, second in enumerate(wanted):
            if i != j and first.variable is not None and second.variable is not None:
                coefficient = bands.correlation[first.variable, second.variable]
                covariance[i, j] = coefficient * first.sigma * second.sigma


@dataclass
class _InstrumentUnknowns:
    names: list[str]
    units: list[str]
    labels: list[str]
    frames: dict[int, tuple[int | None, ...]]
    biases: dict[tuple[int, int, int], int]
    uncertainties: dict[int, float]
    """Standard ones, of those of which something is known beforehand, by their number."""


def _instrument_unknowns(
    machine: Machine, measurements: Measurements, first: int
) -> _InstrumentUnknowns:
    """Unknowns of the instruments that measured anything, numbered from `first` on."""
    unknowns = _InstrumentUnknowns([], [], [], {}, {}, {})

    def add(name: str, unit: str, label: str) -> int:
        unknowns.names.append(name)
        unknowns.units.append(unit)
        unknowns.labels.append(label)
        return first + len(unknowns.names) - 1

    by = measurements.instrument[measurements.row]
    for number, instrument in enumerate(measurements.instruments):
        own = by == number
        if not own.any():
            continue
        unknowns.frames[number] = _frame_and_target(instrument, add)
        for at, uncertainty in zip(
            unknowns.frames[number][6:], instrument.target_uncertainty, strict=True
        ):
            if at is not None and uncertainty > 0.0:
                unknowns.uncertainties[at] = uncertainty
        if not instrument.bias_unknown:
            continue
        read = zip(measurements.observable[own], measurements.strut[own], strict=True)
        for observable, strut in sorted(
            {(int(code), int(strut_number)) for code, strut_number in read}
        ):
            column = column_name(machine, observable, strut)
            unknowns.biases[number, observable, strut] = add(
                f"{instrument.name}.bias.{column}",
                UNITS[observable],
                f"constant that {instrument.name} adds to {column}",
            )
    return unknowns


def _frame_and_target(instrument: Instrument, add: object) -> tuple[int | None, ...]:
    assert callable(add)
    own: list[int | None] = []
    named = [(f"frame.{axis}", "m", f"origin {axis}") for axis in "xyz"]
    named += [(f"frame.r{axis}", "rad", f"rotation about {axis}") for axis in "xyz"]
    for (key, unit, what), unknown in zip(named, instrument.frame.unknown, strict=True):
        name, label = f"{instrument.name}.{key}", f"frame of {instrument.name}, {what}"
        own.append(add(name, unit, label) if unknown else None)
    for axis, uncertainty in zip("xyz", instrument.target_uncertainty, strict=True):
        name, label = f"{instrument.name}.target.{axis}", f"target of {instrument.name}, {axis}"
        sought = instrument.target_unknown or uncertainty > 0.0
        own.append(add(name, "m", label) if sought else None)
    return tuple(own)


_POINTS = {"base": "base joint", "platform": "platform joint", "origin": "origin"}


def label_of(parameter: str) -> str:
    """A parameter for people: "length of strut 1", "base joint x of strut 1", "tool x"."""
    words = parameter.split(".")
    if is_of_family(parameter):
        what, *limb = (word.replace("_", " ") for word in words[1:])
        return " of limb ".join([what, *limb])
    if words[0] == "tool":
        return f"tool point {words[1]}"
    *middle, last = words[2:]
    what = " ".join([_POINTS.get(word, word.replace("_", " ")) for word in middle] + [last])
    if last in ("u", "v"):
        what = " ".join([word.replace("_", " ") for word in middle] + [f"tilt {last}"])
    return f"{what} of {words[0]} {words[1]}"
