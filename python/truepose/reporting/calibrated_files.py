"""Tables of calibrated machine files: where one comes from, and how two of one machine differ."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from truepose.reporting.display import MISSING, number, pose_text, where_highest
from truepose.reporting.table import Table
from truepose.reporting.tables import MOST_LISTED

if TYPE_CHECKING:
    import xarray as xr

    from truepose.files.shown_units import ShownUnits
    from truepose.machine import Machine
    from truepose.reporting.result import Result

_COLUMNS = (
    "old",
    "new",
    "difference",
    "old_uncertainty",
    "new_uncertainty",
    "standard_uncertainty",
    "normalised_difference",
)
_PLUS_MINUS = "\N{PLUS-MINUS SIGN}"


def calibration(machine: Machine) -> Table | None:
    """What a calibrated machine file says of its calibration; None of another file."""
    made = machine.calibration
    if made is None:
        return None
    rows = [
        ("date", made.date),
        ("measurements", f"{made.data} (SHA-256 {made.data_hash[:12]}…)"),
        ("machine file", f"{made.machine} (SHA-256 {made.machine_hash[:12]}…)"),
        ("truepose", made.version),
        ("observations", str(made.observations)),
        ("rms of the residuals before", f"{made.residual_rms_before:.4g}"),
        ("rms of the residuals after", f"{made.residual_rms_after:.4g}"),
    ]
    if made.residual_rms_held_out is not None:
        rows.append(("rms of those not used", f"{made.residual_rms_held_out:.4g}"))
    rows += [("WARNING", " ".join(warning.split())) for warning in made.warning]
    return Table(
        "calibration",
        "Calibration",
        ("", ""),
        tuple(rows),
        words=2,
        note="Residuals are divided by the stated uncertainties.",
    )


def tables(result: xr.Dataset, units: ShownUnits) -> list[Table]:
    """Where the two files come from, what differs of the parameters, and at the tool."""
    return [_files(result), _parameters(result, units), _tool(result, units)]


def _files(result: xr.Dataset) -> Table:
    said = result.attrs
    rows = [
        (what, *(str(said[f"{which}_{key}"]) or MISSING for which in ("old", "new")))
        for what, key in (
            ("file", "file"),
            ("SHA-256", "hash"),
            ("calibrated", "date"),
            ("measurements", "data"),
            ("SHA-256 of them", "data_hash"),
            ("warning", "warning"),
        )
        if key in ("file", "hash", "date") or said[f"old_{key}"] or said[f"new_{key}"]
    ]
    return Table("files", "The two files", ("", "old", "new"), tuple(rows), words=3)


def _parameters(result: xr.Dataset, units: ShownUnits) -> Table:
    normalised = result["normalised_difference"].values
    order = np.argsort(-np.abs(normalised), kind="stable")
    order = order[normalised[order] != 0.0]
    rows = []
    for at in order[:MOST_LISTED]:
        unit = str(result["parameter_units"].values[at])
        shown, fine = units.of(unit), units.small(unit)
        old, new, difference, _, _, deviation, ratio = (
            float(result[name].values[at]) for name in _COLUMNS
        )
        rows.append(
            (
                str(result["parameter"].values[at]),
                "changed" if result["parameter_changed"].values[at] else "",
                f"{number(old * shown.per_si, 6)} {shown.label}",
                f"{number(new * shown.per_si, 6)} {shown.label}",
                f"{number(difference * fine.per_si, 3)} {fine.label}",
                f"{number(deviation * fine.per_si, 3)} {fine.label}",
                number(ratio, 2),
            )
        )
    said = result.attrs
    more = len(order) - len(rows)
    note = (
        f"A parameter changed where it differs by more than {said['parameter_limit']:.2f} standard "
        "uncertainties of the difference. All together: chi-square "
        f"{said['chi_square']:.4g} of {said['chi_square_dof']} degrees of freedom, probability "
        f"{said['chi_square_probability']:.3g} without a change. The two are taken as "
        "independent."
    )
    if more:
        note += f" {more} more differ by less."
    return Table(
        "parameters",
        "Parameters that differ",
        ("parameter", "", "old", "new", "difference", "standard uncertainty", "ratio"),
        tuple(rows),
        words=2,
        note=note,
    )


def _tool(result: xr.Dataset, units: ShownUnits) -> Table:
    commanded = [str(name)[5:] for name in result.coords if str(name).startswith("pose_")]
    rows = []
    for at, quantity in enumerate(result["quantity"].values):
        sizes = result["moved"].values[:, at]
        worst = where_highest(sizes)
        scale = units.error(str(quantity))
        unit, factor = scale.label, scale.per_si
        pose = [float(result[f"pose_{name}"].values[worst]) for name in commanded]
        deviation = float(result["moved_uncertainty"].values[worst, at])
        rows.append(
            (
                str(quantity),
                pose_text(pose, commanded, units),
                f"{number(float(sizes[worst]) * factor, 3)} {unit}",
                f"{_PLUS_MINUS}{number(2.0 * deviation * factor, 3)} {unit}",
                f"{number(float(np.sqrt(np.mean(sizes**2))) * factor, 3)} {unit}",
            )
        )
    return Table(
        "tool",
        "What the change does at the tool",
        ("", "most at", "displacement", "k = 2", "rms over the poses"),
        tuple(rows),
        words=2,
        note="Commanded as the old file has the machine, driven as the new one has it, over "
        f"{result.attrs['poses_used']} poses of the workspace.",
    )


def csv_text(result: Result) -> Iterator[str]:
    """One row a parameter, in the units of the old machine file, which the row names."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(["parameter", "units", *_COLUMNS, "parameter_changed"])
    values = {name: result.values(name) for name in _COLUMNS}
    changed = result.dataset["parameter_changed"].values
    for at, name in enumerate(result.dataset["parameter"].values):
        numbers = [float(values[column].array[at]) for column in _COLUMNS]
        shown = [repr(value) if np.isfinite(value) else "" for value in numbers]
        units = values["old"].unit(at)
        writer.writerow([str(name), units, *shown, str(bool(changed[at])).lower()])
    yield buffer.getvalue()
