"""From a calibration to its machine file, unless the answer is no."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.acceptance import sentences
from truepose.calibration.acceptance.observability import covariance_root, prior_rows
from truepose.calibration.acceptance.tool_uncertainty import Tool
from truepose.calibration.dataset import covariance_of, determined_covariance, verdict_of
from truepose.calibration.identification.tool_effects import tool_effects
from truepose.calibration.result.file import DEFAULT_COVERAGE, Provenance, write_calibrated
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.machine.tables.controller import Holds
from truepose.runs.controller_geometry import require_known_controller

if TYPE_CHECKING:
    from truepose.calibration.calibrate import Calibration


def save(
    calibration: Calibration,
    path: str | Path,
    *,
    original: str | Path,
    date: str,
    controller_holds: Holds = "drawing",
    as_shifts: bool | None = None,
    force: bool = False,
    coverage: float = DEFAULT_COVERAGE,
) -> Machine:
    """Write the calibrated machine to `path`; the machine as it is read from there.

    `original`: the file that was calibrated; `date`: the caller's, written as it is.
    `controller_holds`: "drawing", a controller that was not touched: nominal values stay, what was
    found becomes the middle of their bands, and `compensate` corrects it; "calibrated", one into
    which what was found is loaded, and which is nominal then. `as_shifts`: the former word; it
    warns, and the file is written as `controller_holds` says. `force`: write it though the answer
    is no, with the verdict as a warning inside. `coverage`: half bands in standard deviations. A
    property that was found (an expansion, a compliance) is written without its uncertainty, for
    which a machine file has no place: a warning inside says so.

    Raises `RequestError` (calibration-refused, unknown-choice, excluding-keys; controller-unsaid
    where nominal values stay of which it is not known whose they are; and what `write_calibrated`
    raises).
    """
    if as_shifts is not None:
        _former_word(as_shifts, controller_holds)
    if controller_holds not in get_args(Holds):
        raise _unknown_choice(controller_holds)
    if controller_holds == "drawing":
        require_known_controller(calibration.machine)
    if calibration.failure is not None:
        raise RequestError(calibration.failure)
    verdict = verdict_of(calibration)
    if not (calibration.accepted or force):
        raise RequestError(
            Problem(
                "calibration-refused",
                "this calibration must not be used as it is",
                str(path),
                found=verdict,
                expected="a calibration that the gate accepts",
                hint="force=True writes it with the warning inside",
            )
        )
    fit, checked = calibration.fit, calibration.validation
    data = calibration.measurements
    provenance = Provenance(
        data=Path(data.file).name or "arrays of numbers",
        data_hash=data.digest,
        date=date,
        observations=fit.measurements.n_observation,
        residual_rms_before=calibration.gate.rms_before,
        residual_rms_after=calibration.gate.rms,
        residual_rms_held_out=None
        if checked is None or not np.isfinite(checked.rms_after)
        else checked.rms_after,
    )
    covariance = covariance_to_write(calibration)
    return write_calibrated(
        path,
        calibration.machine,
        fit.unknowns,
        fit.values,
        covariance,
        provenance,
        original=original,
        coverage=coverage,
        controller_holds=controller_holds,
        warnings=(
            *(() if calibration.accepted else (verdict,)),
            *_of_properties(calibration, covariance),
        ),
    )


def _former_word(as_shifts: bool, controller_holds: Holds) -> None:
    """Warn of the word, and refuse it where it says the contrary of the new one."""
    if as_shifts and controller_holds == "calibrated":
        raise RequestError(
            Problem(
                "excluding-keys",
                "as_shifts is for a controller that was not touched",
                found='as_shifts=True and controller_holds="calibrated"',
                expected='controller_holds="drawing", which as_shifts=True means, or "calibrated"',
            )
        )
    warnings.warn(
        'as_shifts goes: say what the controller holds. controller_holds="drawing", the default, '
        'writes what as_shifts=True wrote, and controller_holds="calibrated" what was written '
        "without",
        DeprecationWarning,
        stacklevel=4,
    )


def _unknown_choice(word: object) -> RequestError:
    words = get_args(Holds)
    return RequestError(
        Problem(
            "unknown-choice",
            "a controller holds the geometry of the drawing or the calibrated one",
            found=repr(word),
            expected=one_of(f'"{each}"' for each in words),
            hint=did_you_mean(word, words) if isinstance(word, str) else None,
        )
    )


def covariance_to_write(calibration: Calibration) -> Floats:
    """(n_machine, n_machine) for the file: along what nothing determines, the tolerances' own.

    So it is by itself where they were used; without them the fit leaves such directions as filed.
    Infinite where an unknown of such a direction has no tolerance.
    """
    fit = calibration.fit
    n = fit.unknowns.n_machine
    stated = covariance_of(calibration)
    open_ = (fit.null_space * fit.scale)[:, :n]
    known = np.flatnonzero(fit.unknowns.has_prior[:n])
    members = np.flatnonzero((np.abs(fit.null_space[:, :n]) > 1e-6).any(axis=0))
    if np.isfinite(stated).all() or not np.isin(members, known).all():
        return stated
    rows = prior_rows(fit.unknowns.prior_covariance[:n, :n])
    information = rows.T @ rows
    left = np.linalg.pinv(open_ @ information @ open_.T, hermitian=True)
    covariance: Floats = determined_covariance(calibration) + open_.T @ left @ open_
    return covariance


def _of_properties(calibration: Calibration, covariance: Floats) -> list[str]:
    """What is lost where properties are written without their uncertainty, with both numbers.

    `covariance` (n_machine, n_machine) of what was found.
    """
    unknowns, machine = calibration.fit.unknowns, calibration.machine
    if not unknowns.properties or not np.isfinite(covariance).all():
        return []
    effects = tool_effects(machine, unknowns, calibration.fit.values, calibration.poses).effects
    stated = effects.copy()
    stated[:, :, list(unknowns.properties)] = 0.0
    root, none = covariance_root(covariance), np.zeros((0, unknowns.n_machine))
    components = calibration.gate.after.components
    whole, known = (
        Tool.of(slopes, components, None).uncertainty(root, none) for slopes in (effects, stated)
    )
    names = sentences.listed(
        sentences.collapsed(
            [unknowns.labels[at] for at in unknowns.properties],
            unknowns.labels[: unknowns.n_machine],
        )
    )
    unit, with_them, without = "m", whole.position_max, known.position_max
    what = "position"
    if not with_them:
        unit, with_them, without = "rad", whole.rotation_max, known.rotation_max
        what = "rotation"
    return [
        f"the uncertainty of {names} is not in this file, which has no key for it: without it the "
        f"tool's {what} at the worst pose is known to "
        f"{sentences.quantity(without, unit, units=machine.shown)}, with it, at this file's "
        "temperatures and loads, to "
        f"{sentences.quantity(with_them, unit, units=machine.shown)}"
    ]


__all__ = ["save"]
