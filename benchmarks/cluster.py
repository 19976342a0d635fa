"""Workers: what two gain over one, what a task costs beside its work, and memory for 1e8 poses.

`python -m benchmarks.cluster COUNT` sums up a planar machine of COUNT x COUNT poses on two workers
of its own, and says what memory the client, the scheduler in it and its workers took at most.

What a thousand workers would do is simulated from what a task costs here: the client, which hands
out tasks one by one and takes their results, is the one that is never more than one.
"""

from __future__ import annotations

import heapq
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import truepose
from benchmarks.gcode import ROOT
from benchmarks.rows import Row
from truepose.cluster.evaluator import OnWorkers, TaskEvaluator, evaluator_of
from truepose.cluster.options import ClusterOptions
from truepose.controllers.gcode.program import ProgramOptions
from truepose.error_budget.summary import summary
from truepose.machine import Machine
from truepose.runs.divided import MOST_BLOCKS
from truepose.runs.poses import BLOCK
from truepose.workpiece.evaluate import evaluate_part
from truepose.workpiece.read import read_part
from truepose.workpiece.samples import SampledState, sampled

FEW, MANY, ASKED_MEMORY = 1000, 10_000, 1.1
SIDE, ROUNDS, ASKED_GAIN = 20, 5, 1.8
TASKS, LONG = 2000, 1 << 20
SAMPLES = 4000
WORKERS, POSES, VARIANTS = 1000, 10**9, 10**5


def measure() -> list[Row]:
    """In wall time, on the cores that it is given."""
    gain, pose = _gain()
    return [gain, _part(), *_memory(), *_cost(pose)]


def planar(count: int) -> Machine:
    """The planar machine with `count` x `count` poses."""
    grid = f"workspace.grid={{ x = [200, 400, {count}], y = [100, 300, {count}] }}"
    return truepose.load(ROOT / "machines" / "planar_two_slider.toml", settings=[grid])


@contextmanager
def _one_and_two() -> Iterator[dict[int, TaskEvaluator]]:
    """One worker and two of this computer, by their number."""
    with ExitStack() as stack:
        yield {n: stack.enter_context(evaluator_of(ClusterOptions(n))) for n in (1, 2)}


def _in_turns(of: dict[int, TaskEvaluator], work: Callable[[TaskEvaluator], object]) -> list[float]:
    """s that one worker and two take for some work, the best of `ROUNDS`."""
    times: dict[int, list[float]] = {count: [] for count in of}
    for _ in range(ROUNDS):
        for count, evaluator in of.items():
            begun = time.perf_counter()
            work(evaluator)
            times[count].append(time.perf_counter() - begun)
    return [min(times[count]) for count in of]


def _part() -> Row:
    """The samples of the examples' pocket, by one worker and by two, in turns."""
    machine = truepose.load(ROOT / "machines" / "hexapod.toml")
    program, features = (ROOT / "examples" / "part" / f"pocket.{end}" for end in ("ngc", "toml"))
    read = read_part(machine, program, features, ProgramOptions(None, {}, {}, None, None))
    evaluated = evaluate_part(machine, read, machine.condition, samples=2)
    drawn = SampledState(evaluated.states[0].state, evaluated.values, seed=0)
    with _one_and_two() as of:
        one, other = (sampled(drawn, SAMPLES, evaluator, exact=False) for evaluator in of.values())
        if not np.array_equal(one.values, other.values):
            raise RuntimeError("two workers draw other parts than one")
        times = _in_turns(of, lambda evaluator: sampled(drawn, SAMPLES, evaluator, exact=False))
    return Row(
        "cluster, two workers over one, samples of a part",
        times[0] / times[1],
        "x",
        "at least",
        None,
        f"pocket of the examples on the hexapod, {SAMPLES:,} samples: {times[0]:.2f} s, "
        f"{times[1]:.2f} s, best of {ROUNDS} in turns",
    )


def _gain() -> tuple[Row, float]:
    """One worker and two, in turns, each connected before, and the same numbers of both.

    And s of one worker for a pose.
    """
    ends = {"x": (-4, 4), "y": (-4, 4), "z": (18, 22), "a": (-10, 10), "b": (-10, 10)}
    axes = ", ".join(f"{name} = [{low}, {high}, {SIDE}]" for name, (low, high) in ends.items())
    settings = [f"workspace.grid={{ {axes} }}"]
    machine = truepose.load(ROOT / "machines" / "hexapod.toml", settings=settings)
    with _one_and_two() as of:
        summaries = {count: _summed(machine, evaluator) for count, evaluator in of.items()}
        if not summaries[1].identical(summaries[2]):
            raise RuntimeError("two workers give other numbers than one")
        times = _in_turns(of, lambda evaluator: _summed(machine, evaluator))
    n_pose = int(summaries[1].attrs["poses_used"])
    row = Row(
        "cluster, two workers over one",
        times[0] / times[1],
        "x",
        "at least",
        ASKED_GAIN,
        f"summary of the hexapod, {n_pose:,} poses: {times[0]:.2f} s, {times[1]:.2f} s, best of "
        f"{ROUNDS} in turns; client and scheduler on the same two cores",
    )
    return row, times[0] / n_pose


def _summed(machine: Machine, evaluator: TaskEvaluator) -> object:
    return summary(machine, None, None, None, evaluator)


def _memory() -> list[Row]:
    few, many = (_of_process(count) for count in (FEW, MANY))
    rate = MANY**2 / many["seconds"]
    return [
        Row(
            f"cluster, peak memory of client and scheduler for {MANY**2:.0e} poses to that for "
            f"{FEW**2:.0e}",
            many["mib"] / few["mib"],
            "x",
            "at most",
            ASKED_MEMORY,
            f"planar_two_slider, two workers: {many['mib']:.0f} MiB, {few['mib']:.0f} MiB; of the "
            f"larger of its workers {many['workers']:.0f} MiB, {few['workers']:.0f} MiB",
        ),
        Row(
            "cluster, summary of the planar machine on two workers",
            rate,
            "poses/s",
            "at least",
            None,
            f"{MANY**2:,} poses, {many['seconds']:.0f} s",
        ),
    ]


def _of_process(count: int) -> dict[str, float]:
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks.cluster", str(count)],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    answer: dict[str, float] = json.loads(run.stdout)
    return answer


def _here(count: int) -> dict[str, float]:
    machine = planar(count)
    begun = time.perf_counter()
    found = truepose.budget(machine, summary=True, workers=2)
    seconds = time.perf_counter() - begun
    if found.attrs["poses_used"] != count**2:
        raise RuntimeError("some poses are left out")
    children = _peak(resource.RUSAGE_CHILDREN)
    return {"mib": _own_peak(), "workers": children, "seconds": seconds}


def _peak(who: int) -> float:
    """MiB at most, by the system's accounts."""
    return resource.getrusage(who).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def _own_peak() -> float:
    """MiB that this process took at most. On Linux its account begins with what began it."""
    status = Path("/proc/self/status")
    if not status.exists():
        return _peak(resource.RUSAGE_SELF)
    (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
    return float(line.split()[1]) / 2**10


def _cost(pose: float) -> list[Row]:
    """A task that does nothing, and one that gives back a mebibyte; then the simulation.

    `pose`: s of a worker for one pose of the hexapod.
    """
    with evaluator_of(ClusterOptions(2)) as evaluator:
        assert isinstance(evaluator, OnWorkers)
        _drained(evaluator, 0, 20)
        wall, empty = (
            seconds / TASKS for seconds in min(_drained(evaluator, 0, TASKS) for _ in range(3))
        )
        long = min(_drained(evaluator, LONG, 200)[1] for _ in range(3)) / 200
    byte = max(long - empty, 0.0) / LONG
    machine = planar(1000)
    begun = time.perf_counter()
    truepose.budget(machine, summary=True)
    planar_pose = 2.0 * (time.perf_counter() - begun) / 1e6  # two threads here, one a worker
    rows = [
        Row(
            "cluster, handing out a task and taking its result",
            1e3 * empty,
            "ms",
            "at most",
            None,
            f"processor time of client and scheduler, {TASKS:,} tasks that do nothing, and "
            f"{1e9 * byte:.2f} ns a byte of the result more; {1e3 * wall:.2f} ms wall time with "
            "two workers on the same two cores",
        )
    ]
    works = (
        Work(
            "planar, 1e9 poses", POSES // (BLOCK * MOST_BLOCKS), BLOCK * MOST_BLOCKS * planar_pose
        ),
        Work("planar, 1e9 poses, a block a task", POSES // BLOCK, BLOCK * planar_pose),
        Work("hexapod, 1e9 poses", POSES // (BLOCK * MOST_BLOCKS), BLOCK * MOST_BLOCKS * pose),
        Work("1e5 variants of 1 s, ten a task", VARIANTS // 10, 10.0),
        Work("1e5 variants of 1 s, one a task", VARIANTS, 1.0),
    )
    for work in works:
        seconds = simulated(work, WORKERS, empty)
        ideal = work.tasks * work.seconds / WORKERS
        rows.append(
            Row(
                f"cluster, simulated: {work.name}, {WORKERS:,} workers, busy for",
                100.0 * ideal / seconds,
                "%",
                "at least",
                None,
                f"{work.tasks:,} tasks of {work.seconds:.3g} s: {seconds:.0f} s; the client "
                f"keeps {work.seconds / empty:,.0f} workers busy",
            )
        )
    return rows


@dataclass(frozen=True)
class Work:
    """So many tasks, each of so many seconds for a worker."""

    name: str
    tasks: int
    seconds: float


def simulated(work: Work, workers: int, cost: float) -> float:
    """s until all tasks are done: a client that takes `cost` s a task, and workers that wait."""
    ready = [0.0] * min(workers, work.tasks)
    client, last = 0.0, 0.0
    for _ in range(work.tasks):
        client = max(client, heapq.heappop(ready)) + cost
        last = client + work.seconds
        heapq.heappush(ready, last)
    return max(last, *ready)


def nothing(shared: object, size: int) -> bytes:
    """What a worker does that is asked for so many bytes."""
    return bytes(size)


def _drained(evaluator: OnWorkers, size: int, count: int) -> tuple[float, float]:
    """Wall time, and processor time of this process, the scheduler in it, s."""

    def tasks() -> Iterator[tuple[int, int]]:
        for number in range(count):
            yield number, size

    begun, busy = time.perf_counter(), time.process_time()
    for _ in evaluator.results(nothing, None, tasks()):
        pass
    return time.perf_counter() - begun, time.process_time() - busy


if __name__ == "__main__":
    print(json.dumps(_here(int(sys.argv[1]))))
