"""A study put together: everything that a report says of a machine, computed.

The command and the Python function do it one way. Who wants to see how far it is, or to refuse
what comes out, gives a `Watcher`.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truepose.errors import RequestError
from truepose.reporting.display import is_position, nearest_middle, where_highest
from truepose.reporting.study import Study
from truepose.runs.poses import Progress
from truepose.runs.quantities import quantities
from truepose.verdict.answer import AFTER, STATES, met

if TYPE_CHECKING:
    import xarray as xr

    from truepose.calibration.measurements import Measurements
    from truepose.error_budget.evaluate import Evaluation
    from truepose.machine import Machine
    from truepose.plausibility import Oddity
    from truepose.reporting.workspace_check import WorkspaceCheck
    from truepose.verdict.answer import Answer

SAMPLES = 100_000
"""Samples at each of the report's two poses: two digits of a standard deviation."""
ELLIPSE_SAMPLES = 10_000
"""Samples at each of the poses of which the report draws an ellipse."""
SEED = 0
"""Of the report, so that the same file gives the same page."""

UNITS = {"monte_carlo": "samples", "ellipses": "samples"}
"""What is counted in the progress of a result, where not poses."""


class Watcher:
    """Who looks on while a study is put together. This one looks away, and takes all that comes."""

    def progress(self, what: str, unit: str = "poses") -> AbstractContextManager[Progress | None]:
        """A step: what is to be called with how much of it is done, if anything."""
        return nullcontext()

    def waiting(self, what: str) -> AbstractContextManager[None]:
        """A step of which nobody knows how long it takes."""
        return nullcontext()

    def looked_at(
        self, machine: Machine, workspace: WorkspaceCheck, odd: tuple[Oddity, ...]
    ) -> None:
        """It is known which poses the machine can use, and what looks odd, before any answer."""

    def evaluated(self, machine: Machine, result: Evaluation) -> None:
        """There is an error budget over the workspace: to refuse it, or to say what it warns of."""

    def computed(self, machine: Machine, result: xr.Dataset) -> None:
        """There is another result over the workspace, with the poses that it left out."""


def evaluation(machine: Machine, watcher: Watcher) -> Evaluation:
    """The error budget before it is a Dataset, which takes longer to import than to evaluate."""
    from truepose.error_budget.evaluate import evaluate

    with watcher.progress("error budget") as report:
        result = evaluate(machine, progress=report)
    watcher.evaluated(machine, result)
    return result


def compensation(machine: Machine, watcher: Watcher) -> xr.Dataset:
    """The compensation over the file's workspace, of any file: who commands asks for more."""
    from truepose.compensation.compensate import against_nominal

    with watcher.progress("compensation") as report:
        result = against_nominal(machine, progress=report)
    watcher.computed(machine, result)
    return result


def internal_forces(machine: Machine, watcher: Watcher) -> xr.Dataset:
    """The internal forces over the file's workspace."""
    from truepose.error_budget.strain import strain

    with watcher.progress("internal forces") as report:
        result = strain(machine, progress=report)
    watcher.computed(machine, result)
    return result


def answers(machine: Machine, watcher: Watcher, *states: str) -> tuple[Answer, ...]:
    """The verdict over the file's workspace in the states asked, by default both."""
    from truepose.verdict.accuracy import accuracy

    with watcher.progress("accuracy") as report:
        return accuracy(machine, states=states or STATES, progress=report)


def compared(machine: Machine, watcher: Watcher) -> Study:
    """The machine with budget and compensation, the verdict on both, and what looks odd."""
    from truepose.plausibility import oddities
    from truepose.verdict.tightening import tightening

    budget = evaluation(machine, watcher).dataset()
    corrected = compensation(machine, watcher)
    verdicts = answers(machine, watcher)
    return Study(
        machine,
        budget,
        corrected,
        verdicts,
        oddities=oddities(machine),
        tightening=None if met(verdicts, AFTER) else tightening(machine),
    )


def study(
    machine: Machine,
    measurements: Measurements | str | Path | None = None,
    watcher: Watcher | None = None,
) -> Study:
    """The machine with all that a report says of it, and a calibration if there are measurements.

    Raises as `truepose.budget` and `truepose.calibrate` do, and `KeyboardInterrupt`: of half a
    report nothing is wanted.
    """
    watcher = watcher or Watcher()
    whole = with_time(compared(machine, watcher))
    whole = with_how_sure(with_strain(whole, watcher), watcher)
    return whole if measurements is None else with_calibration(whole, measurements, watcher)


def with_time(study: Study) -> Study:
    """The study with the error over time, where the file has a temperature log.

    At two poses: the one nearest the middle, and the one where the logged temperatures do most.
    """
    from truepose.error_budget.over_time import over_time

    machine = study.machine
    if machine.condition.temperature_log is None:
        return study
    middle = int(nearest_middle(study.poses)[0])
    thermal = study.position_norm(study.values("error")[:, study.sources.index("thermal")])
    chosen = list(dict.fromkeys([middle, where_highest(thermal)]))
    return replace(study, over_time=over_time(machine, study.poses[chosen]))


def with_calibration(
    study: Study, measurements: Measurements | str | Path, watcher: Watcher
) -> Study:
    """The study with a calibration by the defaults."""
    from truepose.calibration.calibrate import calibrate

    with watcher.waiting("calibration"):
        result = calibrate(study.machine, measurements)
    return replace(study, calibration=result.dataset)


def with_strain(study: Study, watcher: Watcher) -> Study:
    """The study with the internal forces, where the machine is over-constrained."""
    if not study.machine.kernel.overconstrained:
        return study
    return replace(study, strain=internal_forces(study.machine, watcher))


def with_how_sure(study: Study, watcher: Watcher) -> Study:
    """The study with samples, worst case, bounds and shares, where anything is not known.

    At two poses, so that a report stays quick: the one nearest the middle, and the one where the
    linear worst case is highest; coverage ellipses at up to 25. What is refused is left out, with
    the reason.
    """
    from truepose.reporting.uncertainty_tables import spread_over
    from truepose.uncertainty_analysis.bounds import bounds
    from truepose.uncertainty_analysis.monte_carlo import monte_carlo
    from truepose.uncertainty_analysis.shares import shares
    from truepose.uncertainty_analysis.worst_case import worst_case

    if not any(study.has_band):
        return study
    machine = study.machine
    middle = int(nearest_middle(study.poses)[0])
    two = list(dict.fromkeys([middle, where_highest(study.largest)]))
    poses = study.poses[two]
    sampling = partial(monte_carlo, machine, seed=SEED)
    work: dict[str, Callable[..., Any]] = {
        "worst_case": partial(worst_case, machine, poses),
        "monte_carlo": partial(sampling, poses, samples=SAMPLES),
        "bounds": partial(bounds, machine, poses),
        "shares": partial(shares, machine, poses, seed=SEED),
    }
    if len(study.positions) > 1:
        axes = [at for at, name in enumerate(machine.commanded) if is_position(name)]
        chosen = study.poses[spread_over(study.poses, axes)]
        work["ellipses"] = partial(sampling, chosen, samples=ELLIPSE_SAMPLES)
    results: dict[str, xr.Dataset] = {}
    missing: dict[str, str] = {}
    for name, of in work.items():
        try:
            with watcher.progress(name.replace("_", " "), UNITS.get(name, "poses")) as report:
                results[name] = of(progress=report)
        except RequestError as refusal:
            missing[name] = _why(refusal)
        else:
            if results[name].attrs.get("interrupted"):
                raise KeyboardInterrupt  # of a report nothing is wanted then
    if "ellipses" in results:
        there = results["ellipses"]["ellipse"].notnull().all(("axis", "other_axis")).values
        results["ellipses"] = results["ellipses"].isel(pose=there)
        if not there.any():
            missing["ellipses"] = f"{results.pop('ellipses').attrs['not_assembled']}."
    return replace(
        study,
        sampled=_at_95(study, watcher),
        worst_case=results.get("worst_case"),
        monte_carlo=results.get("monte_carlo"),
        ellipses=results.get("ellipses"),
        bounds=results.get("bounds"),
        shares=results.get("shares"),
        missing=missing,
    )


def _at_95(study: Study, watcher: Watcher) -> tuple[Answer, ...]:
    """The errors that 95 % of all machines stay below, at the worst poses of the workspace.

    The verdict's, where it is at that coverage.
    """
    from truepose.verdict.accuracy import at_quick_coverage
    from truepose.verdict.coverage import QUICK
    from truepose.verdict.states import Population

    machine = study.machine
    if machine.accuracy.at == QUICK:
        return study.accuracy
    with watcher.progress("coverage") as report:
        population = Population(machine, progress=report)
        return tuple(
            at_quick_coverage(population, state, kind)
            for state in STATES
            for kind in quantities(machine.components)
        )


def _why(refusal: RequestError) -> str:
    """The first problem as one sentence."""
    problem = refusal.problems[0]
    detail = f" ({problem.found})" if problem.found else ""
    return f"{problem.message}{detail}."
