"""The steps of the commands that say how sure an error is: sample, bound, share out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

import truepose
from truepose.cli import _steps
from truepose.cli._cluster import telling
from truepose.cli._options import Request
from truepose.cli._progress import progress
from truepose.errors import Problem, ReadingError, RequestError
from truepose.files.units import UnitSystem
from truepose.files.wording import counted
from truepose.reporting import reading, uncertainty_tables
from truepose.reporting.display import is_position
from truepose.reporting.formats import netcdf
from truepose.runs.poses import broken

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

SYNTAX = "x=200:400,y=100:300"


def sample(request: Request, machine: Machine, **asked: Any) -> xr.Dataset:
    """The error sampled over the file's workspace; after Ctrl-C, what there is by then."""
    with telling(), progress("Monte Carlo", "samples", first="the worst poses") as report:
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
    with telling(), progress("bounds", of[0], first=of[1]) as report:
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
