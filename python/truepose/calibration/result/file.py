"""The calibrated machine as a machine file: the original's text, with what was found written in.

For a controller that was not touched every parameter keeps the value that the controller has, and
the deviation found is the middle of its band. For one into which the geometry found is loaded every
parameter that the unknowns move has its identified value. Bands are normal, of the identified
covariance, with all correlations. What the file says besides, comments included, stays.

An accuracy that the original asks in the worst case (it states no coverage) is asked at a coverage
in the calibrated file: normal bands have no ends, and a calibration knows most by the correlations,
which the worst case does not use.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import tomlkit

from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.identification.properties import Property
from truepose.calibration.result.bands import (
    Banded,
    ToleranceCovariance,
    banded,
    tolerance_covariance,
)
from truepose.calibration.result.directions import (
    PartDirection,
    deviation_jacobian,
    direction_at,
    directions,
)
from truepose.calibration.result.toml_edits import MachineText, warning_comment
from truepose.errors import MachineFileError, Problem, RequestError
from truepose.files.writing import replacing, require_writable
from truepose.machine import Machine, load
from truepose.machine.families.parameters import FamilyParameters, is_of_family
from truepose.machine.tables.controller import Holds
from truepose.machine.workspace import Accuracy
from truepose.sources import REGISTRY
from truepose.sources.deviation import Deviation
from truepose.sources.tolerance import bands_of
from truepose.version import version

DEFAULT_COVERAGE = 2.0
"""Half bands in standard deviations."""

AT = 0.95
"""At which coverage the accuracy is asked where the original does not say (`[accuracy] at`)."""

ENDING = ".toml"

_SAME = 4e-15
"""Relative to the value: what writing and reading a number may change."""

_NAMED = 6
"""Unknowns that a message names; more are counted."""

_SAME_BAND = 1e-9
"""Relative to the standard deviations: the same of a covariance."""


class MachineUnknowns(Protocol):
    """What is read of the unknowns of a fit: those of the machine come first."""

    @property
    def names(self) -> tuple[str, ...]:
        """(n,) by which groups are called."""
        ...

    @property
    def n_machine(self) -> int:
        """How many are the machine's."""
        ...

    @property
    def columns(self) -> Indices:
        """(k,) parameters that they move."""
        ...

    @property
    def effects(self) -> Floats:
        """(k, n) by how much."""
        ...

    @property
    def properties(self) -> Mapping[int, Property]:
        """Those that move no parameter, by number."""
        ...


@dataclass(frozen=True)
class Provenance:
    """Where a calibration comes from. Residuals are divided by their uncertainties.

    `data`: name of the file of measurements, `data_hash` its SHA-256. `date`: as the caller gives
    it; nothing here reads a clock. `observations`: measured numbers that were fitted.
    """

    data: str
    data_hash: str
    date: str
    observations: int
    residual_rms_before: float
    residual_rms_after: float
    residual_rms_held_out: float | None = None


class PropertyEdit(NamedTuple):
    """A property to be written: `strut.1.expansion`, its dimension, its value in SI."""

    path: str
    dimension: str
    value: float


def write_calibrated(
    path: str | Path,
    machine: Machine,
    unknowns: MachineUnknowns,
    values: Floats,
    covariance: Floats,
    provenance: Provenance,
    *,
    original: str | Path,
    coverage: float = DEFAULT_COVERAGE,
    controller_holds: Holds = "drawing",
    warnings: Sequence[str] = (),
) -> Machine:
    """Write the calibrated machine to `path` and return it as it is read from there.

    `values` (n,) and `covariance` (n, n) of the unknowns, SI; those of instruments are not read.
    `original`: the file that `machine` was read from. `coverage`: half bands in standard
    deviations. `controller_holds`: "drawing", a controller that was not touched, whose geometry
    stays nominal, with what was found as known deviations; "calibrated", one into which what was
    found is loaded, which is nominal then. `warnings` go into the file, for a forced result.

    Raises `RequestError` (`output-*`, calibration-undetermined, calibration-file-changed,
    calibration-not-written), and writes the file whole or not at all.
    """
    path, original = Path(path), Path(original)
    require_writable(path, [ENDING], [original])
    own_values = np.asarray(values, np.float64)[: unknowns.n_machine]
    own_covariance = np.asarray(covariance, np.float64)[: unknowns.n_machine, : unknowns.n_machine]
    require_determined(path, unknowns, own_values, own_covariance)
    result = CalibratedValues.of(machine, unknowns, own_values, own_covariance, controller_holds)
    held = _held(machine, controller_holds)
    text = MachineText(original, machine, _changed(original, machine))
    _write_values(text, machine, result)
    for edit in property_edits(machine, unknowns, own_values):
        text.set_property(*edit)
    _write_bands(text, machine, result, coverage)
    given_at = text.set_coverage(Accuracy(at=AT).at_text)
    text.move_to(path)
    text.set_controller(held)
    _write_provenance(text, machine, provenance, warnings)
    with replacing(path) as temporary:
        temporary.write_text(text.text(), encoding="utf-8")
        try:
            written = load(temporary, registry=REGISTRY)
        except MachineFileError as error:
            problem = error.problems[0]
            raise _not_written(path, f"{problem.code}: {problem.message}") from error
        filed = load(original, settings=dict(machine.settings), registry=REGISTRY)
        asked = replace(filed.accuracy, at=AT) if given_at else filed.accuracy
        _require_same(path, filed, result, asked, written)
        if written.controller_holds != held:
            raise _not_written(path, "what the controller holds differs")
    return load(path, registry=REGISTRY)


def property_edits(
    machine: Machine, unknowns: MachineUnknowns, values: Floats
) -> list[PropertyEdit]:
    """What the identified properties change in the file, for values (n_machine,) of all."""
    edits = []
    for number, identified in unknowns.properties.items():
        changed = identified.changed(machine, float(values[number]))
        if changed is None:
            continue
        edits += [PropertyEdit(*edit) for edit in identified.edits(machine, changed)]
    return edits


@dataclass(frozen=True)
class CalibratedValues:
    """What the file is to say: nominal values and axes, shifts of all parameters, bands.

    `nominal` (n_parameter,) has 0 for the tilts of the directions that `axes` gives anew; `moved`
    (k,) are the parameters whose own tolerance is replaced. `found_family`: what was found of the
    family's parameters; `family` is as they then are, `family_shift` what stays to be known of
    them, SI. `own_shift` (n_parameter,) is what `shift` is without them.
    """

    nominal: Floats
    axes: tuple[tuple[PartDirection, Floats], ...]
    shift: Floats
    bands: Banded
    moved: Indices
    forgotten: Deviation | None
    own_shift: Floats
    family: FamilyParameters | None
    found_family: tuple[str, ...]
    family_shift: Mapping[str, float]

    @property
    def kept(self) -> Flags:
        """(k,) columns of the file's bands that stay: of what was not identified."""
        old = self.forgotten
        if old is None:
            return np.zeros(0, np.bool_)
        found = [n for n in old.group_quantities if old.group_names[n] in self.found_family]
        of_parameters = ~np.isin(old.parameters, self.moved)
        return np.where(old.of_quantities, ~np.isin(old.groups, found), of_parameters)

    @classmethod
    def of(
        cls,
        machine: Machine,
        unknowns: MachineUnknowns,
        values: Floats,
        covariance: Floats,
        controller_holds: Holds,
        *,
        new_axes: bool = True,
    ) -> CalibratedValues:
        """`new_axes`: whether directions are told by new axes, as in a file, or by their tilts."""
        stays = controller_holds == "drawing"
        count = len(machine.parameters)
        effects = np.zeros((count, unknowns.n_machine))
        np.add.at(effects, np.asarray(unknowns.columns), unknowns.effects[:, : unknowns.n_machine])
        names = unknowns.names[: unknowns.n_machine]
        of_family = np.array([is_of_family(name) for name in names], np.bool_)
        found_family = tuple(name for name in names if is_of_family(name))
        changes = dict(zip(found_family, values[of_family].tolist(), strict=True))
        family = machine.family
        if family is not None and not stays:
            family = family.changed(changes)
        moved = np.asarray(effects[:, ~of_family].any(axis=1), np.bool_)
        anything = np.asarray(effects.any(axis=1), np.bool_)
        deviation = effects @ values
        nominal = np.array(machine.nominal) + (0.0 if stays else deviation)
        axes = []
        for direction in directions(machine) if new_axes else ():
            at = list(direction.columns)
            if not nominal[at].any():
                continue
            axis = direction_at(direction.axis, nominal[at])
            if anything[at].any():
                effects[at] = deviation_jacobian(direction.axis, nominal[at], axis) @ effects[at]
                if stays:
                    deviation[at] = effects[at] @ values
                anything[at] = True
                moved[at] = moved[at].any()
            nominal[at] = 0.0
            axes.append((direction, axis))
        if family is not None:
            # The file's effects are those of its family, about its axes.
            family = family.about({f"{d.table}.{d.part}.{d.key}": axis for d, axis in axes})
            for number in np.flatnonzero(of_family):
                effects[:, number] = 0.0
                for name, effect in family.effects(names[number]).items():
                    effects[machine.parameters.index(name), number] = effect
        columns = np.flatnonzero(anything)
        bands = banded(columns, effects[columns], covariance, names)
        nothing = np.zeros(count)
        return cls(
            nominal,
            tuple(axes),
            deviation if stays else nothing,
            bands,
            np.flatnonzero(moved),
            bands_of(machine),
            effects[:, ~of_family] @ values[~of_family] if stays else nothing,
            family,
            found_family,
            changes if stays else dict.fromkeys(changes, 0.0),
        )


def _held(machine: Machine, asked: Holds) -> Holds:
    """What the written file says: whose geometry stays nominal is still what it was before."""
    return machine.controller_holds or asked if asked == "drawing" else asked


def _write_values(text: MachineText, machine: Machine, result: CalibratedValues) -> None:
    """Nominal values and directions that differ from those of the file."""
    turned_columns = {column for direction, _ in result.axes for column in direction.columns}
    filed = np.array(machine.nominal)
    of_family = np.zeros(filed.size, np.bool_)
    for name, value in _write_family(text, machine, result).items():
        column = machine.parameters.index(name)
        filed[column], of_family[column] = value, True
    for name in machine.replaced:
        filed[machine.parameters.index(name)] = np.nan
    # What the family gives anew, it gives to its rounding.
    slack = np.where(of_family, _SAME * np.abs(result.nominal), 0.0)
    changed = ~(np.abs(result.nominal - filed) <= slack)
    # A point is written as a whole: beside one component the family's others are not read.
    points = {
        name.rpartition(".")[0]
        for name, is_changed in zip(machine.parameters, changed, strict=True)
        if is_changed
    }
    for column, name in enumerate(machine.parameters):
        beside = of_family[column] and name.rpartition(".")[0] in points
        written = (changed[column] or beside) and column not in turned_columns
        if written and not name.endswith((".u", ".v")):
            text.set_parameter(name, float(result.nominal[column]))
    for direction, axis in result.axes:
        text.set_direction(direction.table, direction.part, direction.key, axis)


def _write_family(
    text: MachineText, machine: Machine, result: CalibratedValues
) -> dict[str, float]:
    """What was found of the family's parameters; the values that then follow, where others."""
    old, new = machine.family, result.family
    if old is None or new is None:
        return {}
    text.set_family(
        new, [name for name in result.found_family if new.value(name) != old.value(name)]
    )
    return new.moved(old)


def _write_bands(
    text: MachineText, machine: Machine, result: CalibratedValues, coverage: float
) -> None:
    """The bands of what was identified, in place of those of the file, and their correlations."""
    names, bands, old = machine.parameters, result.bands, result.forgotten
    variables = variable_names(machine, bands)
    at = {int(column): index for index, column in enumerate(bands.columns)}
    own = {column: bands.own(index) for column, index in at.items()}
    member = {column: variable for column, variable in own.items() if variable is not None}
    covered = set() if old is None else set(old.parameters[~old.of_quantities].tolist())
    banded_family = {bands.names[variable]: variable for variable in bands.of_family()}
    for name in result.found_family:
        shift = result.family_shift[name]
        if name in banded_family:
            deviation = float(bands.deviations[banded_family[name]])
            text.set_tolerance(name, _normal(shift, deviation, coverage, None))
        else:
            text.set_tolerance(name, {"band": [shift, shift]})
    for column in result.moved.tolist():
        shift = float(result.own_shift[column])
        if column in member:
            effect = float(bands.effects[at[column], member[column]])
            grouped = bands.names[member[column]]
            text.set_tolerance(
                names[column],
                _normal(shift, effect, coverage, variables[member[column]] if grouped else None),
            )
        elif shift or column in covered:
            text.set_tolerance(names[column], {"band": [shift, shift]})
    _forget_correlations(text, machine, result)
    # What is independent of all others needs no row of zeros.
    linked = (bands.correlation != 0.0).sum(axis=1) > 1
    if linked.any():
        between = [name for name, link in zip(variables, linked, strict=True) if link]
        text.add_correlation(between, bands.correlation[np.ix_(linked, linked)])


def _normal(shift: float, effect: float, coverage: float, group: str | None) -> dict[str, Any]:
    """A normal tolerance as the table of a file, SI."""
    deviation = abs(effect)
    if shift:
        half = coverage * deviation
        stated: dict[str, Any] = {"band": [shift - half, shift + half], "distribution": "normal"}
    else:
        stated = {"standard_deviation": deviation}
    stated["sigmas"] = float(coverage)
    if group is not None:
        stated["group"] = group
        if effect < 0.0:
            stated["sign"] = -1
    return stated


def variable_names(machine: Machine, bands: Banded) -> list[str]:
    """What each variable is called: its parameter, or its group, which is called as no other is."""
    columns = [int(np.flatnonzero(bands.effects[:, v])[0]) for v in range(len(bands.names))]
    names = []
    for column, name in zip(columns, bands.names, strict=True):
        is_parameter = name in machine.parameters
        own = machine.parameters[bands.columns[column]]
        names.append((f"{name} as calibrated" if is_parameter else name) if name else own)
    return names


def _forget_correlations(text: MachineText, machine: Machine, result: CalibratedValues) -> None:
    """Take what was identified out of the correlations that the file has already."""
    old = result.forgotten
    if old is None or old.correlation is None:
        return
    moved = set(result.moved.tolist())
    gone: set[str] = set()
    kept: dict[str, int] = {}
    columns = zip(old.parameters.tolist(), old.groups.tolist(), old.variables, strict=True)
    for parameter, group, number in columns:
        names = [] if group in old.group_quantities else [machine.parameters[parameter]]
        names += [old.group_names[group]] if group in old.group_names else []
        found = group in old.group_quantities and old.group_names[group] in result.found_family
        if found or (parameter in moved and group not in old.group_quantities):
            gone |= set(names)
        else:
            kept |= dict.fromkeys(names, int(number))
    kept = {name: number for name, number in kept.items() if name not in gone}
    comments = text.forget_correlations(gone, kept)
    if comments:
        text.append("\n".join(comments) + "\n")


def _write_provenance(
    text: MachineText, machine: Machine, provenance: Provenance, warnings: Sequence[str]
) -> None:
    if "calibration" in text.toml:
        del text.toml["calibration"]
    table = tomlkit.table()
    table["data"] = provenance.data or "measurements"
    table["data_hash"] = provenance.data_hash
    table["machine"] = machine.file
    table["machine_hash"] = machine.file_hash
    table["date"] = provenance.date
    table["version"] = version()
    table["observations"] = int(provenance.observations)
    table["residual_rms_before"] = float(provenance.residual_rms_before)
    table["residual_rms_after"] = float(provenance.residual_rms_after)
    if provenance.residual_rms_held_out is not None:
        table["residual_rms_held_out"] = float(provenance.residual_rms_held_out)
    if warnings:
        table["warning"] = list(warnings)
    text.append(tomlkit.dumps({"calibration": table}))
    lines = "".join(f"{warning_comment(warning)}\n" for warning in warnings)
    text.toml = tomlkit.parse(lines + text.text())


def _require_same(
    path: Path, filed: Machine, result: CalibratedValues, asked: Accuracy, written: Machine
) -> None:
    """Refuse a file that, read again, is not the machine that was to be written.

    `filed`: the original with its settings, whose condition may not be the one calibrated in.
    """
    if written.parameters != filed.parameters:
        raise _not_written(path, "the parameters have other names")
    off = np.abs(written.nominal - result.nominal) > _SAME * np.abs(result.nominal)
    if off.any():
        raise _not_written(path, f"{filed.parameters[int(np.flatnonzero(off)[0])]} differs")
    axes = {direction.columns: axis for direction, axis in result.axes}
    for direction in directions(written):
        wanted = axes.get(direction.columns)
        if wanted is not None and np.abs(direction.axis - wanted).max() > _SAME:
            raise _not_written(path, f"{direction.table}.{direction.part}.{direction.key} differs")
    _require_same_bands(path, filed, result, written)
    if written.accuracy != asked or written.condition != filed.condition:
        raise _not_written(path, "condition or accuracy differ")
    strange = set(written.data_files.values()) - set(filed.data_files.values())
    if strange:
        raise _not_written(path, "the data files differ")


def _require_same_bands(
    path: Path, machine: Machine, result: CalibratedValues, written: Machine
) -> None:
    read_back, filed, bands = (
        tolerance_covariance(written),
        tolerance_covariance(machine),
        result.bands,
    )
    # Also of what a family's parameter moves that was found, whose own tolerances stay.
    moved = np.union1d(result.moved, bands.columns)
    count = len(machine.parameters)
    kept = tolerance_covariance(machine, result.kept)
    wanted = kept.covariance
    wanted[np.ix_(bands.columns, bands.columns)] += (
        bands.effects @ bands.correlation @ bands.effects.T
    )
    shift = result.shift + kept.shift
    deviation = np.sqrt(np.diagonal(wanted))[moved]
    # Of a band about a shift the ends are written, which have the shift's rounding.
    slack = _SAME_BAND * deviation + _SAME * np.abs(shift[moved])
    most = np.outer(slack, deviation) + np.outer(deviation, slack)
    off = np.abs(read_back.covariance - wanted)[np.ix_(moved, moved)] > most
    if off.any():
        raise _not_written(
            path, f"the band of {_first(machine, moved, np.asarray(off.any(axis=1)))} differs"
        )
    shifted = np.asarray(np.abs(read_back.shift - shift)[moved] > slack)
    if shifted.any():
        raise _not_written(path, f"the shift of {_first(machine, moved, shifted)} differs")
    others = np.setdiff1d(np.arange(count), moved)
    lost = _has_band(read_back)[others] != _has_band(filed)[others]
    if lost.any():
        raise _not_written(path, f"the tolerance of {_first(machine, others, lost)} differs")


def _has_band(of: ToleranceCovariance) -> np.ndarray:
    return np.asarray(of.effects.any(axis=1))


def _first(machine: Machine, columns: Indices, flagged: np.ndarray) -> str:
    return machine.parameters[int(columns[np.flatnonzero(flagged)[0]])]


def require_determined(
    path: str | Path, unknowns: MachineUnknowns, values: Floats, covariance: Floats
) -> None:
    """Refuse what has no finite value or covariance: no machine file can say it."""
    fine = np.isfinite(values) & np.isfinite(covariance).all(axis=1)
    if fine.all():
        return
    named = [unknowns.names[at] for at in np.flatnonzero(~fine)]
    more = f" and {len(named) - _NAMED} more" if len(named) > _NAMED else ""
    raise RequestError(
        Problem(
            "calibration-undetermined",
            "what is not determined cannot be written as a band",
            str(path),
            found=f"no finite uncertainty of {', '.join(named[:_NAMED])}{more}",
            expected="a finite value and covariance of every unknown of the machine",
            hint="give it a tolerance, or leave it out of what is identified",
        )
    )


def _changed(original: Path, machine: Machine) -> RequestError:
    return RequestError(
        Problem(
            "calibration-file-changed",
            "the machine file is not the one that was read for the calibration",
            str(original),
            found="another content than when it was read",
            expected=f"the file with the SHA-256 {machine.file_hash[:12]}...",
            hint="calibrate again with the file as it is now",
        )
    )


def _not_written(path: Path, why: str) -> RequestError:
    return RequestError(
        Problem(
            "calibration-not-written",
            f"the calibrated file, read again, is not the calibrated machine: {why}",
            str(path),
            found=why,
            expected="the same machine",
            hint="nothing was written; please report it with the machine file",
        )
    )
