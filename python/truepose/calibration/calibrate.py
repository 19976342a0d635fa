"""`tp.calibrate`: from measurements to a machine that may be used, or a reason why not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats
from truepose.calibration.acceptance import Gate, HeldOut, assess
from truepose.calibration.acceptance.decision import CONTRADICTED, MARGIN
from truepose.calibration.acceptance.tool_uncertainty import (
    Considered,
    commanded_components,
    tool_components,
)
from truepose.calibration.data_checks import (
    HYPOTHESES,
    Refit,
    Suspicion,
    alternatives,
    explained_otherwise,
    suspicions,
)
from truepose.calibration.identification.assembly_modes import (
    in_unstated_modes,
    of_other_modes,
    placed_as_read,
)
from truepose.calibration.identification.consider_covariance import consider_covariance
from truepose.calibration.identification.fit import Fit, fit, unfitted
from truepose.calibration.identification.placement import Placements, place_instruments
from truepose.calibration.identification.reliability import (
    ExternalReliability,
    external_reliability,
)
from truepose.calibration.identification.robust import Outlier, outliers
from truepose.calibration.identification.tool_effects import (
    ToolEffects,
    candidates,
    relative_tool,
    tool_effects,
    workspace_poses,
)
from truepose.calibration.identification.unknowns import unknowns_of
from truepose.calibration.identification.validate import Validation, validate
from truepose.calibration.instruments import REGISTRY
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.calibration.residual_checks import residual_patterns
from truepose.errors import Problem, RequestError
from truepose.lazy_names import of_the_package
from truepose.machine import Machine
from truepose.representation import Facts, Represented
from truepose.runs.arguments import checked

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine.tables.controller import Holds


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Represented):
    """What measurements say of a machine, and whether it may be used.

    `gate.accepted` is the answer, `gate.words` says why. `suspicions`: mistakes that the data look
    like; `outliers` readings that do not fit; `validation` None where there was too little to
    hold anything back. `poses` (n, n_commanded): where the tool was looked at, those that are
    `usable` (n,): the calibrated machine reaches them too. `seed`: of the folds. `failure`: why no
    machine was found that explains the measurements, where something is wrong with these; the
    machine then stays as filed. `external_reliability`: how far a wrong reading that is not named
    can move the tool there.
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
    failure: Problem | None = None
    external_reliability: ExternalReliability | None = None

    def _facts(self) -> Facts:
        from truepose.calibration.dataset import verdict_of

        yield "machine", self.machine.name
        yield "accepted", self.accepted
        yield "unknowns", self.fit.unknowns.count
        yield "rows", self.measurements.n_row
        yield "readings", self.measurements.n_observation
        yield "readings that do not fit", len(self.outliers)
        yield "suspicions", [suspicion.code for suspicion in self.suspicions]
        yield "verdict", verdict_of(self)

    def _repr_html_(self) -> str:
        """The answer, then what the command says of it, without the list of all unknowns."""
        tables: str = of_the_package("calibration_html")(self)
        return super()._repr_html_() + tables

    @property
    def accepted(self) -> bool:
        """Whether the calibrated machine may be used."""
        return self.gate.accepted

    def calibrated(self) -> Machine:
        """The machine with the nominal geometry, the bands and the correlations that were found.

        What its file says with `controller_holds="calibrated"`, read again, but for the accuracy's
        words. Raises `RequestError` (calibration-undetermined) where something has no finite
        uncertainty.
        """
        from truepose.calibration.result.calibrated_machine import calibrated_machine
        from truepose.calibration.result.save import covariance_to_write

        return calibrated_machine(
            self.machine, self.fit.unknowns, self.fit.values, covariance_to_write(self)
        )

    def save(
        self,
        path: str | Path,
        *,
        original: str | Path,
        date: str,
        controller_holds: Holds = "drawing",
        as_shifts: bool | None = None,
        force: bool = False,
    ) -> Machine:
        """Write the calibrated machine file; see `truepose.calibration.result.save.save`.

        By default for a controller that was not touched; `controller_holds="calibrated"`: for one
        into which the geometry found is loaded.
        """
        from truepose.calibration.result.save import save

        return save(
            self,
            path,
            original=original,
            date=date,
            controller_holds=controller_holds,
            as_shifts=as_shifts,
            force=force,
        )

    @property
    def dataset(self) -> xr.Dataset:
        """Everything as data; `docs/calibration.md` has the schema."""
        from truepose.calibration.dataset import dataset_of

        return dataset_of(self)


@checked
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
    (unknown-parameter, no-unknowns, bad-band, too-few-measurements, no-workspace; no-fit where no
    machine explains the measurements, and no known blunder says why),
    `TrueposeError` where a row's temperatures or loads ask for what the machine does not say.
    """
    whole = data if isinstance(data, Measurements) else read_measurements(data, machine)
    if whole.held_out.all():
        raise _nothing_to_fit(whole)
    table = workspace_poses(machine, poses)
    unknowns = unknowns_of(machine, whole, identify)
    standing = _placed(machine, whole)
    whole, in_other_modes = placed_as_read(machine, whole, standing)
    if in_other_modes.any():
        standing = _placed(machine, whole)
    used = whole.select(~whole.held_out) if whole.held_out.any() else whole
    suspected = suspicions(machine, whole, standing) + of_other_modes(whole, in_other_modes)
    refit = Refit(machine, used, unknowns, use_prior)
    failure, checked = None, None
    try:
        fitted = fit(
            machine,
            used,
            unknowns,
            use_prior=use_prior,
            robust=robust,
            placements=standing if used is whole else None,
        )
    except RequestError as refused:
        (failure, *_) = refused.problems
        if not _refuse(suspected) and failure.code == "no-fit":
            suspected += explained_otherwise(refit, None, HYPOTHESES)
        if failure.code != "no-fit" or not _refuse(suspected):
            raise
        fitted = unfitted(used, unknowns, place_instruments(machine, used), use_prior=use_prior)
    else:
        suspected += in_unstated_modes(machine, fitted, whole)
        checked = validate(machine, whole, fitted, folds=folds, seed=seed, robust=robust)
    effects = tool_effects(machine, unknowns, fitted.values, table)
    left_out = consider_covariance(machine, fitted, identify, table[effects.usable])
    rows = np.sqrt(fitted.weights)[:, np.newaxis] * fitted.jacobian / fitted.birge
    tool, _ = relative_tool(machine, effects, rows, unknowns)
    if failure is None and not _refuse(suspected):
        if fitted.noise > CONTRADICTED:
            suspected += explained_otherwise(refit, fitted, HYPOTHESES)
        else:
            suspected += alternatives(refit, fitted, tool, table[effects.usable], HYPOTHESES)
        if not _refuse(suspected):
            suspected += residual_patterns(machine, fitted, tool)
    gate = _assessed(machine, fitted, checked, effects, margin, left_out, suspected, failure)
    return Calibration(
        machine,
        whole,
        fitted,
        gate,
        outliers(machine, fitted, whole, checked),
        suspected,
        checked,
        table,
        effects.usable,
        seed,
        failure,
        external_reliability(fitted, tool),
    )


def _refuse(suspected: Sequence[Suspicion]) -> bool:
    return any(suspicion.refuses for suspicion in suspected)


def _placed(machine: Machine, whole: Measurements) -> Placements | None:
    """Where the instruments stand; None where from no start the readings can be followed."""
    try:
        return place_instruments(machine, whole)
    except RequestError:
        return None


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


def _assessed(
    machine: Machine,
    fitted: Fit,
    checked: Validation | None,
    tool: ToolEffects,
    margin: float,
    considered: Considered | None,
    suspected: Sequence[Suspicion],
    failure: Problem | None,
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
        tool=tool.effects,
        components=tool_components(machine),
        commanded=commanded_components(machine),
        positions=tool.positions,
        weights=fitted.weights,
        by=phrases(machine, fitted.measurements),
        nominal=unknowns.nominal_sizes(machine),
        held_out=_held_out(fitted, checked),
        target=(accuracy.target, accuracy.angle_target),
        candidates=candidates(machine, fitted),
        margin=margin,
        noise=(fitted.noise, fitted.freedom),
        considered=considered,
        suspicions=suspected,
        failure=None if failure is None else failure.message,
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
