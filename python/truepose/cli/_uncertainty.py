"""The steps of the commands that say how sure an error is: sample, bound, share out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

import truepose
from truepose.cli import _steps
from truepose.cli._options import Request
from truepose.cli._progress import progress
from truepose.errors import Problem, ReadingError, RequestError
from truepose.files.units import UnitSystem
from truepose.files.wording import counted
from truepose.reporting import reading, uncertainty_tables
from truepose.reporting.display import is_position, nearest_middle, where_highest
from truepose.reporting.formats import netcdf
from truepose.reporting.study import Study
from truepose.runs.poses import broken
from truepose.runs.quantities import quantities
from truepose.verdict.accuracy import at_coverage
from truepose.verdict.states import STATES, Population

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine
    from truepose.verdict.answer import Answer

SAMPLES = 100_000
"""Samples at each of the report's two poses: two digits of a standard deviation."""
ELLIPSE_SAMPLES = 10_000
"""Samples at each of the poses of which the report draws an ellipse."""
SEED = 0
"""Of the report, so that the same file gives the same page."""

COVERAGE = 0.95
"""At which the report says how far off the tool is over the workspace."""
MOST_POSES, MOST_DRAWS = 3, 10_000
"""For that: it is a number, no answer; `[accuracy] at` takes all poses and as many as decide."""

UNITS = {"monte_carlo": "samples", "ellipses": "samples"}
"""What is counted in the progress of a result, where not poses."""

SYNTAX = "x=200:400,y=100:300"


def sample(request: Request, machine: Machine, **asked: Any) -> xr.Dataset:
    """The error sampled over the file's workspace; after Ctrl-C, what there is by then."""
    with progress("Monte Carlo", "samples", first="the worst poses") as report:
        result = truepose.monte_carlo(machine, progress=report, **asked)
    if result.attrs.get("interrupted"):
        count = int(result["samples"].sum())
        click.echo(
            f"Interrupted after {count:,} samples over {counted(result.sizes['pose'], 'pose')}: "
            "the result is of these.",
            err=True,
        )
    _steps.refuse_left_out_of(request, machine, result)
    return result


def bound(
    request: Request,
    machine: Machine,
    region: str | None,
    **asked: Any,
) -> xr.Dataset:
    """The proven bounds over the file's poses, or over a region given as text.

    After Ctrl-C what is proven by then. Of what is `asked`, None is what was not.
    """
    asked = {name: value for name, value in asked.items() if value is not None}
    if region is not None:
        asked["region"] = read_region(machine, region)
    if "resume" in asked:
        asked["resume"] = netcdf.read(asked["resume"])
    of = ("poses", "the worst poses") if region is None else ("boxes", "the highest bounds")
    with progress("bounds", of[0], first=of[1]) as report:
        result = truepose.bounds(machine, progress=report, **asked)
    if result.attrs.get("interrupted"):
        click.echo(uncertainty_tables.interrupted_bounds(result), err=True)
    if region is None:
        _steps.refuse_left_out_of(request, machine, result)
    return result


def share(request: Request, machine: Machine, **asked: Any) -> xr.Dataset:
    """The shares of the variance over the file's workspace."""
    with progress("shares", first="the worst poses") as report:
        result = truepose.shares(machine, progress=report, **asked)
    if result.attrs.get("interrupted"):
        click.echo(
            f"Interrupted after {counted(result.sizes['pose'], 'pose')}, those of the largest "
            "first-order deviation: the result is of these.",
            err=True,
        )
    _steps.refuse_left_out_of(request, machine, result)
    return result


def read_region(machine: Machine, text: str) -> dict[str, tuple[float, float]]:
    """`x=200:400,y=100:300` in the file's units -> ends of each freedom, m and rad.

    A number may bring its own unit, as in `x=0.2 m:0.4 m`. Raises `RequestError` (bad-region)
    with all parts that cannot be read; what a region may be is for `truepose.bounds` to say.
    """
    units = UnitSystem(machine.file_units)
    region: dict[str, tuple[float, float]] = {}
    problems: list[Problem] = []
    for part in text.split(","):
        name, equals, ends = (piece.strip() for piece in part.partition("="))
        low, colon, high = (piece.strip() for piece in ends.partition(":"))
        if not (name and equals and colon and low and high) or ":" in high:
            problems.append(_bad_region(part, "not a freedom with two ends"))
        elif name in region:
            problems.append(_bad_region(part, f"{name} is there twice"))
        else:
            dimension = "length" if is_position(name) else "angle"
            try:
                region[name] = (units.read(low, dimension), units.read(high, dimension))
            except ReadingError as failure:
                problems.append(_bad_region(part, failure.message, failure.expected))
                continue
            if region[name][0] > region[name][1]:
                problems.append(_bad_region(part, f"the ends of {name} are reversed"))
    if problems:
        raise RequestError(*problems)
    return region


def _bad_region(part: str, message: str, expected: str | None = None) -> Problem:
    return Problem(
        "bad-region",
        f"--region: {message}",
        found=part.strip() or "nothing",
        expected=expected or f"freedoms with two ends each, such as {SYNTAX}",
    )


def keeps_accuracy(machine: Machine, result: xr.Dataset) -> bool:
    """Whether the accuracy asked is proven to be kept: everywhere, and of all that is asked.

    It is not where a machine inside the bands was met that cannot be assembled.
    """
    if "left_out_status" in result.coords and broken(result["left_out_status"].values).any():
        return False
    asked = {"position": machine.accuracy.target, "orientation": machine.accuracy.angle_target}
    if not (result["status"].values == uncertainty_tables.PROVEN).all():
        return False
    sizes = result["magnitude"].values
    limits = (asked.get(name) for name in reading.quantities(result))
    return all(
        limit is None or bool((sizes[..., at] <= limit).all()) for at, limit in enumerate(limits)
    )


def with_how_sure(study: Study) -> Study:
    """The study with samples, worst case, bounds and shares, where anything is not known.

    At two poses, so that a report stays quick: the one nearest the middle, and the one where the
    linear worst case is highest; coverage ellipses at up to 25. What is refused is left out, with
    the reason.
    """
    if not any(study.has_band):
        return study
    machine = study.machine
    middle = int(nearest_middle(study.poses)[0])
    two = list(dict.fromkeys([middle, where_highest(study.largest)]))
    poses = study.poses[two]
    sampling = partial(truepose.monte_carlo, machine, seed=SEED)
    work: dict[str, Callable[..., Any]] = {
        "worst_case": partial(truepose.worst_case, machine, poses),
        "monte_carlo": partial(sampling, poses, samples=SAMPLES),
        "bounds": partial(truepose.bounds, machine, poses),
        "shares": partial(truepose.shares, machine, poses, seed=SEED),
    }
    if len(study.positions) > 1:
        axes = [at for at, name in enumerate(machine.commanded) if is_position(name)]
        chosen = study.poses[uncertainty_tables.spread_over(study.poses, axes)]
        work["ellipses"] = partial(sampling, chosen, samples=ELLIPSE_SAMPLES)
    results: dict[str, xr.Dataset] = {}
    missing: dict[str, str] = {}
    for name, of in work.items():
        try:
            with progress(name.replace("_", " "), UNITS.get(name, "poses")) as report:
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
        sampled=_at_95(study),
        worst_case=results.get("worst_case"),
        monte_carlo=results.get("monte_carlo"),
        ellipses=results.get("ellipses"),
        bounds=results.get("bounds"),
        shares=results.get("shares"),
        missing=missing,
    )


def _at_95(study: Study) -> tuple[Answer, ...]:
    """The errors that 95 % of all machines stay below, at the worst poses of the workspace.

    The verdict's, where it is at that coverage.
    """
    machine = study.machine
    if machine.accuracy.at == COVERAGE:
        return study.accuracy
    with progress("coverage") as report:
        population = Population(machine, progress=report)
        return tuple(
            at_coverage(
                population,
                state,
                kind,
                COVERAGE,
                None,
                most_poses=MOST_POSES,
                most_draws=MOST_DRAWS,
            )
            for state in STATES
            for kind in quantities(machine.components)
        )


def _why(refusal: RequestError) -> str:
    """The first problem as one sentence."""
    problem = refusal.problems[0]
    detail = f" ({problem.found})" if problem.found else ""
    return f"{problem.message}{detail}."
