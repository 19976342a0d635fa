"""`tp.calibrate`: from measurements to a machine that may be used, or a reason why not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats
from truepose.calibration.acceptance.decision import MARGIN, Gate, HeldOut, assess
from truepose.calibration.acceptance.tool_uncertainty import Tool, tool_components
from truepose.calibration.data_checks import Suspicion, suspicions
from truepose.calibration.identification.assembly_modes import (
    in_unstated_modes,
    of_other_modes,
    placed_as_read,
)
from truepose.calibration.identification.consider_covariance import (
    consider_covariance,
    with_considered,
)
from truepose.calibration.identification.fit import Fit, fit, place_instruments
from truepose.calibration.identification.reliability import (
    ExternalReliability,
    external_reliability,
)
from truepose.calibration.identification.robust import Outlier, outliers
from truepose.calibration.identification.tool_effects import (
    candidates,
    tool_effects,
    workspace_poses,
)
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of
from truepose.calibration.identification.validate import Validation, validate
from truepose.calibration.instruments import REGISTRY
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.errors import Problem, RequestError
from truepose.machine import Machine

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Calibration:
    """What measurements say of a machine, and whether it may be used.

    `gate.accepted` is the answer, `gate.words` says why. `suspicions`: mistakes that the data look
    like; `outliers` readings that do not fit; `validation` None where there was too little to
    hold anything back. `poses` (n, n_commanded): where the tool was looked at, those that are
    `usable` (n,): the calibrated machine reaches them too. `seed`: of the folds.
    `external_reliability`: how far a wrong reading that is not named can move the tool there.
    """

    machine: Machine
    measurements: Measurements
    fit: Fit
    gate: Gate
    outliers: tuple[Outlier, ...]
    suspicions: tuple[Suspicion, ...]
    validation: Validation | None
    poses: Floats
    usable: Flags
    seed: int = 0
    external_reliability: ExternalReliability | None = None

    @property
    def accepted(self) -> bool:
        """Whether the calibrated machine may be used."""
        return self.gate.accepted and not any(suspicion.refuses for suspicion in self.suspicions)

    def calibrated(self) -> Machine:
        """The machine with the values found for its parameters; its bands are the file's still."""
        unknowns = self.fit.unknowns
        change = unknowns.parameter_change(self.fit.values)
        nominal = self.machine.nominal[unknowns.columns] + change
        names = [self.machine.parameters[column] for column in unknowns.columns]
        return self.machine.replace(dict(zip(names, nominal.tolist(), strict=True)))

    def save(
        self,
        path: str | Path,
        *,
        original: str | Path,
        date: str,
        as_shifts: bool = False,
        force: bool = False,
    ) -> Machine:
        """Write the calibrated machine file; see `truepose.calibration.result.save.save`."""
        from truepose.calibration.result.save import save

        return save(self, path, original=original, date=date, as_shifts=as_shifts, force=force)

    @property
    def dataset(self) -> xr.Dataset:
        """Everything as data; `docs/calibration.md` has the schema."""
        from truepose.calibration.dataset import dataset_of

        return dataset_of(self)


def calibrate(
    machine: Machine,
    data: Measurements | str | Path,
    *,
    identify: Sequence[str] = (),
    use_prior: bool = True,
    robust: bool = True,
    poses: ArrayLike | None = None,
    folds: int = 5,
    seed: int = 0,
    margin: float = MARGIN,
) -> Calibration:
    """Find the machine's parameters from measurements, and decide whether they may be used.

    `data`: measurements, or the file of them. `identify`: what is to be found, patterns over
    parameters, groups of tolerances, `strut.*.expansion`, `strut.*.compliance`, each with a half
    band where one is given (`"strut.1.length=0.5 mm"`); nothing: all that has a tolerance.
    `use_prior`: tolerances count as knowledge; without it the measurements alone decide. `robust`:
    readings beyond three standard uncertainties lose weight. `poses` (n, n_commanded): where the
    tool counts, m and rad, default the file's workspace. `folds`, `seed`: how rows are held back
    for validation, where the measurements state none. `margin`: what is left of the tool's
    uncertainty must be less than this share.

    Raises `MachineFileError` for a file of measurements that cannot be read, `RequestError`
    (unknown-parameter, no-unknowns, bad-band, too-few-measurements, no-fit, no-workspace),
    `TrueposeError` where a row's temperatures or loads ask for what the machine does not say.
    """
    whole = data if isinstance(data, Measurements) else read_measurements(data, machine)
    if whole.held_out.all():
        raise _nothing_to_fit(whole)
    table, joints, placements = workspace_poses(machine, poses)
    unknowns = unknowns_of(machine, whole, identify)
    whole, in_other_modes = placed_as_read(machine, whole, unknowns)
    suspected = _suspected(machine, whole, unknowns) + of_other_modes(whole, in_other_modes)
    used = whole.select(~whole.held_out) if whole.held_out.any() else whole
    try:
        fitted = fit(machine, used, unknowns, use_prior=use_prior, robust=robust)
    except RequestError as failure:
        raise _with_suspicions(failure, suspected) from failure
    suspected += in_unstated_modes(machine, fitted, whole)
    checked = validate(machine, whole, fitted, folds=folds, seed=seed, robust=robust)
    effects, usable = tool_effects(machine, unknowns, fitted.values, joints, placements)
    gate = _assessed(machine, fitted, checked, effects, placements[usable, :3], margin)
    rest = consider_covariance(machine, fitted, identify, joints[usable], placements[usable])
    gate = with_considered(gate, rest, (machine.accuracy.target, machine.accuracy.angle_target))
    return Calibration(
        machine,
        whole,
        fitted,
        gate,
        outliers(machine, fitted, whole, checked),
        suspected,
        checked,
        table,
        usable,
        seed,
        external_reliability(fitted, _judged_tool(machine, gate, effects, placements[usable, :3])),
    )


def _judged_tool(machine: Machine, gate: Gate, effects: Floats, positions: Floats) -> Tool:
    """What unknowns do at the tool, without what moves the machine as a whole."""
    gauge = [direction.effects for direction in gate.directions if direction.kind == "gauge"]
    tool = Tool.of(effects, tool_components(machine), positions)
    return tool.relative(np.array(gauge).reshape(-1, effects.shape[2]))


def _suspected(machine: Machine, whole: Measurements, unknowns: Unknowns) -> tuple[Suspicion, ...]:
    """What is suspected, with unknown frames first set where they fit best.

    A mistake in the data may put the frames in a wrong place: what then stays unexplained is
    checked with the frames as declared too.
    """
    try:
        standing = place_instruments(machine, whole, unknowns)[0].measurements
    except RequestError:
        return suspicions(machine, whole)
    as_placed = suspicions(machine, standing)
    if standing.instruments == whole.instruments or all(
        suspicion.code != "far-off" for suspicion in as_placed
    ):
        return as_placed
    as_declared = suspicions(machine, whole)
    return (
        as_placed if any(suspicion.code == "far-off" for suspicion in as_declared) else as_declared
    )


def _nothing_to_fit(whole: Measurements) -> RequestError:
    return RequestError(
        Problem(
            "too-few-measurements",
            "every row is kept from the fit",
            whole.file or None,
            found=f"{whole.n_row} rows to check with, none to fit",
            expected="rows to fit, and some to check with",
        )
    )


def _with_suspicions(failure: RequestError, suspected: Sequence[Suspicion]) -> RequestError:
    """What stopped the fit, its hint being the suspicions that refuse the measurements."""
    sentences = "; ".join(suspicion.sentence for suspicion in suspected if suspicion.refuses)
    if not sentences or any(problem.code != "no-fit" for problem in failure.problems):
        return failure
    return RequestError(*(replace(problem, hint=sentences) for problem in failure.problems))


def _assessed(
    machine: Machine,
    fitted: Fit,
    checked: Validation | None,
    effects: Floats,
    positions: Floats,
    margin: float,
) -> Gate:
    unknowns = fitted.unknowns
    accuracy = machine.accuracy
    return assess(
        unknowns,
        values=fitted.values,
        jacobian=fitted.jacobian,
        residual=fitted.residual,
        before=fitted.before,
        use_prior=fitted.use_prior,
        tool=effects,
        components=tool_components(machine),
        positions=positions,
        weights=fitted.weights,
        by=phrases(machine, fitted.measurements),
        nominal=unknowns.nominal_sizes(machine),
        held_out=_held_out(fitted, checked),
        target=(accuracy.target, accuracy.angle_target),
        candidates=candidates(machine, fitted),
        margin=margin,
        noise=(fitted.noise, fitted.freedom),
    )


def _held_out(fitted: Fit, checked: Validation | None) -> tuple[HeldOut, ...]:
    if checked is None or not checked.used.any():
        return ()
    # Without tolerances nothing else shows that a fit promises too little to be of use.
    unknowns = fitted.unknowns
    compared = bool(unknowns.has_prior[: unknowns.n_machine].all())
    consistent = compared and checked.consistent
    return (HeldOut(checked.rms_before, checked.rms_after, consistent=consistent),)


def phrases(machine: Machine, measurements: Measurements) -> list[str]:
    """How each instrument says where the machine is: "by heights alone"."""
    texts = []
    for number, instrument in enumerate(measurements.instruments):
        read = measurements.observables(number)
        if not read:
            continue
        phrase = REGISTRY[instrument.kind].phrase(read)
        rows = measurements.instrument == number
        heights = measurements.placements[rows, 2]
        if read == ("z",) and np.ptp(heights) < 1e-3 * machine.characteristic_length:
            phrase = "by a flat bed"
        texts.append(phrase)
    return list(dict.fromkeys(texts))


__all__ = ["Calibration", "calibrate", "phrases"]
