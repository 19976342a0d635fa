"""Pieces of work whose time two commits are compared by; each is run in a process of its own.

They use what the package had before and has now: public functions, and methods of the kernel that
stayed. `python -m benchmarks.works NAME --machines FOLDER` does one with the package that it finds,
and says how long it took, or what the package does not have.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Results = Mapping[str, NDArray]


@dataclass(frozen=True)
class Task:
    """A piece of work, ready to be done."""

    call: Callable[[], object]
    repeats: int
    """Of a short call inside one timing."""
    results: Callable[[], Results] | None = None
    """What the other commit's results are compared with; None: nothing is."""
    clock: Callable[[], float] = time.process_time
    first: Callable[[], object] | None = None
    """A call beforehand that imports and makes byte code; None: the call itself, once."""


@dataclass(frozen=True)
class Work:
    """What is compared, and what is asked of it."""

    what: str
    prepare: Callable[[Path, bool], Task]
    """From the folder of machine files; the second says whether to do only a little."""
    unit: str = "s"
    asked: float | None = None
    """At least that often as fast as before."""
    rounds: int = 7
    """Timings in a process, of which the least counts."""
    processes: int = 5
    """Of each side, in turns."""
    memory: bool = False
    """Whether the process's peak memory is compared, too."""
    no_more: Mapping[str, float] | None = None
    """Results that may be up to so many times those before: bounds, which may be closer, too."""
    incomparable: str = ""
    """Why results are not equal to 1e-12, where they need not be."""


def bounds_at_pose(machines: Path, small: bool) -> Task:
    """Proven bounds of the hexapod at home, 0.1 mm on 42 parameters."""
    from benchmarks.bounded import home_bounds
    from benchmarks.hexapod import geometry_columns, load

    machine = load(machines)
    _, _, bounds = home_bounds(machine, geometry_columns(machine))

    def results() -> Results:
        lower, upper, magnitudes, proven, *_ = bounds()
        if list(proven) != ["proven"]:
            raise RuntimeError("nothing is proven at home")
        return {"lower": np.array(lower), "upper": np.array(upper), "magnitude": magnitudes}

    return Task(bounds, 1 if small else 3, results)


def _budget(machines: Path, name: str, count: int, only: tuple[str, ...] = ()) -> Task:
    import truepose
    from benchmarks.hexapod import workspace_poses

    machine = truepose.load(machines / f"{name}.toml")
    if only:
        sources = tuple(source for source in machine.sources if source.name in only)
        machine = replace(machine, sources=sources)
    poses = workspace_poses(machine, count)

    def results() -> Results:
        found = truepose.budget(machine, poses[:2000])
        return {
            str(name): values.values
            for name, values in found.data_vars.items()
            if values.dtype.kind == "f"
        }

    # No more than a few poses beforehand: the peak memory is to be that of the call.
    return Task(lambda: truepose.budget(machine, poses), 1, results, first=results)


def budget_of_a_million(machines: Path, small: bool) -> Task:
    """Three sources of the hexapod, the largest error at a pose in it."""
    return _budget(machines, "hexapod", 3_000 if small else 1_000_000)


def budget_of_ten(machines: Path, small: bool) -> Task:
    """All sources there are."""
    return _budget(machines, "hexapod_all_sources", 1_000 if small else 100_000)


def budget_of_three(machines: Path, small: bool) -> Task:
    """Three of these sources, same machine."""
    from benchmarks.all_sources import PAPER

    return _budget(machines, "hexapod_all_sources", 1_000 if small else 100_000, PAPER)


def region(machines: Path, small: bool) -> Task:
    """Bounds over the planar machine's workspace, or over a small part of it."""
    import truepose
    from benchmarks.bounded import GAP, PLANAR

    machine = truepose.load(machines / "planar_two_slider.toml")
    over = {"x": (0.29, 0.31), "y": (0.19, 0.21)} if small else PLANAR

    def call():
        found = truepose.bounds(machine, region=over, gap=GAP)
        if found["status"].values != "proven":
            raise RuntimeError(f"not proven: {found['status'].values}")
        return found

    def results() -> Results:
        return {name: call()[name].values for name in ("lower", "upper", "magnitude")}

    return Task(call, 1, results)


def forward_call(machines: Path, small: bool) -> Task:
    """`Machine.forward` of one pose."""
    from benchmarks.hexapod import Batch

    batch = Batch.of(1, machines)
    names = [batch.machine.parameters[i] for i in batch.columns]
    moved = batch.machine.nominal[batch.columns] + batch.deviations[0]
    machine = batch.machine.replace(dict(zip(names, moved.tolist(), strict=True)))
    joints = batch.joints[0]
    start = batch.machine.kernel.pose_of(batch.placements)[0]
    forward = machine.forward
    return Task(
        lambda: forward(joints, start),
        10 if small else 20_000,
        lambda: {"pose": forward(joints, start)},
    )


def calibration(machines: Path, small: bool) -> Task:
    """42 parameters of the hexapod from 50 poses."""
    from benchmarks.calibration import POSES, Fit
    from benchmarks.hexapod import Batch

    batch = Batch.of(POSES, machines)
    fit = Fit.of(batch)
    nominal = batch.machine.nominal[batch.columns]
    return Task(fit.solve, 1 if small else 50, lambda: {"values": nominal + fit.values()})


def monte_carlo(machines: Path, small: bool) -> Task:
    """A sample of the hexapod: 42 normals, covariance, quantiles of components and lengths."""
    from benchmarks.hexapod import load
    from benchmarks.monte_carlo import COUNT, Kernel
    from truepose import _kernel

    kernel = Kernel(load(machines))
    count = 2_000 if small else COUNT
    shares = (0.025, 0.5, 0.975)

    def call() -> Results:
        tallies = kernel.tallies(count)
        return {
            "mean": tallies.mean,
            "covariance": tallies.covariance,
            "quantiles": tallies.quantiles(shares),
        }

    _kernel.threads(1)
    return Task(call, 1 if small else 8, call)


def forward_batch(machines: Path, small: bool) -> Task:
    """Exact displacements of 4096 poses, 42 moved parameters."""
    from benchmarks.forward_batch import COUNT
    from benchmarks.hexapod import Batch

    batch = Batch.of(64 if small else COUNT, machines)
    kernel = batch.machine.kernel

    def call():
        return kernel.displacement(batch.joints, batch.placements, batch.columns, batch.deviations)

    return Task(call, 1 if small else 50, lambda: {"displacement": call()[0]})


def sensitivity_kept(machines: Path, small: bool) -> Task:
    """6 x 51 sensitivities of 1024 poses."""
    from benchmarks.hexapod import Batch
    from benchmarks.sensitivity import COUNT

    batch = Batch.of(64 if small else COUNT, machines)
    columns = np.arange(len(batch.machine.parameters))

    def call():
        return batch.machine.kernel.sensitivity_at(batch.joints, batch.placements, columns)

    return Task(call, 1 if small else 50, lambda: {"sensitivity": call()[0]})


def _command(arguments: list[str]) -> Task:
    """A command as its launcher calls it; the time is that of the process, from its start."""
    module, function = os.environ["TRUEPOSE_ENTRY"].split(":")
    launcher = f"import sys; from {module} import {function}; sys.argv[0] = 'truepose'; "
    command = [sys.executable, "-c", f"{launcher}sys.exit({function}())", *arguments]

    def call() -> None:
        # Exit code 1 is a verdict: the accuracy asked is not kept.
        ended = subprocess.run(command, stdout=subprocess.DEVNULL, check=False)
        if ended.returncode not in (0, 1):
            raise RuntimeError(f"truepose {' '.join(arguments)} ended with {ended.returncode}")

    def clock() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    return Task(call, 1, None, clock)


def command_shares(machines: Path, small: bool) -> Task:
    """`truepose shares` on the hexapod's workspace."""
    few = ["--samples", "64", "--set", "workspace.grid.x=[0, 0, 1]"] if small else []
    return _command(["shares", str(machines / "hexapod.toml"), *few])


def command_montecarlo(machines: Path, small: bool) -> Task:
    """`truepose montecarlo` on the hexapod's workspace."""
    few = ["--samples", "1000"] if small else []
    return _command(["montecarlo", str(machines / "hexapod.toml"), *few])


def command_check(machines: Path, small: bool) -> Task:
    """`truepose check` of the hexapod."""
    return _command(["check", str(machines / "hexapod.toml")])


def command_list(machines: Path, small: bool) -> Task:
    """`truepose init --list`."""
    return _command(["init", "--list"])


def command_help(machines: Path, small: bool) -> Task:
    """`truepose --help`."""
    return _command(["--help"])


_OTHER_SAMPLES = "other samples are meant, the confidence is the same"
_ANOTHER_PROOF = "another enclosure, both proven and within the gap asked"

WORKS: Mapping[str, Work] = {
    "bounds_at_pose": Work(
        "bounds at a pose, hexapod, 42 parameters",
        bounds_at_pose,
        "ms",
        asked=6.0,
        no_more={"magnitude": 1.0003},
    ),
    "budget_of_a_million": Work(
        "budget, 1,000,000 poses of the hexapod, three sources",
        budget_of_a_million,
        asked=4.0,
        rounds=1,
        processes=3,
        memory=True,
    ),
    "budget_of_ten": Work("budget, 100,000 poses, ten sources", budget_of_ten, rounds=2),
    "budget_of_three": Work("budget, 100,000 poses, three of them", budget_of_three, rounds=2),
    "region": Work(
        "region: planar workspace",
        region,
        asked=2.5,
        rounds=2,
        processes=3,
        incomparable=_ANOTHER_PROOF,
    ),
    "forward_call": Work("one forward call from Python", forward_call, "us", asked=1.8),
    "calibration": Work("calibration, 42 x 50", calibration, "us", asked=1.8),
    "monte_carlo": Work(
        "Monte Carlo, 65,536 samples with normals, covariance, quantiles",
        monte_carlo,
        "ms",
        asked=1.25,
    ),
    "forward_batch": Work("forward in a batch, 4096 poses", forward_batch, "us"),
    "sensitivity_kept": Work("sensitivity kept, 1024 poses", sensitivity_kept, "us"),
    "command_shares": Work(
        "`truepose shares`, hexapod's workspace",
        command_shares,
        asked=5.0,
        rounds=1,
        processes=3,
        incomparable=_OTHER_SAMPLES,
    ),
    "command_montecarlo": Work(
        "`truepose montecarlo`, hexapod's workspace",
        command_montecarlo,
        asked=2.0,
        rounds=1,
        processes=3,
        incomparable=_OTHER_SAMPLES,
    ),
    "command_check": Work("`truepose check`, hexapod", command_check, "ms"),
    "command_list": Work("`truepose init --list`", command_list, "ms"),
    "command_help": Work("`truepose --help`, interpreter in it", command_help, "ms"),
}


def main() -> None:
    """Do one piece of work and say how long it took, as JSON on standard output."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.works", description=__doc__)
    parser.add_argument("name", choices=WORKS)
    parser.add_argument("--machines", type=Path, required=True)
    parser.add_argument("--small", action="store_true", help="do only a little")
    parser.add_argument("--results", type=Path, help="a file for what was worked out")
    arguments = parser.parse_args()
    answer = done(WORKS[arguments.name], arguments)
    import truepose

    print(json.dumps(answer | {"package": str(truepose.__file__)}))


def done(work: Work, arguments: argparse.Namespace) -> dict[str, object]:
    """Least seconds of a call and peak memory in bytes, or why the work cannot be done."""
    try:
        task = work.prepare(arguments.machines, arguments.small)
        (task.first or task.call)()
        seconds = min(_seconds(task) for _ in range(1 if arguments.small else work.rounds))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        if task.results is not None and arguments.results is not None:
            np.savez(arguments.results, **task.results())
    except (ImportError, AttributeError, TypeError, ValueError, RuntimeError) as error:
        return {"missing": f"{type(error).__name__}: {error}"}
    return {"seconds": seconds, "peak": peak * (1 if sys.platform == "darwin" else 1024)}


def _seconds(task: Task) -> float:
    start = task.clock()
    for _ in range(task.repeats):
        task.call()
    return (task.clock() - start) / task.repeats


if __name__ == "__main__":
    main()
