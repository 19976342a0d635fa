"""How times grow with the size of the work: exponents fitted over a range, and two threads.

An exponent of 1 is linear growth; less is a cost that does not grow. Processor time on one thread,
the least of several calls; of two threads wall time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

import truepose
from benchmarks.rows import Row
from benchmarks.scaled_work import (
    CLOSURES,
    FEW_MOVED,
    WITH_GUIDE,
    Call,
    Scaled,
    bounds,
    budget,
    every_scaling,
    monte_carlo,
    moved,
)

ASKED = 1.1
"""Of what should be linear."""
ROUNDS, ENOUGH = 5, 0.02  # s, of a timing that a short call is repeated to fill
SLOW = 0.5  # s, of a call that is timed only twice


def measure() -> list[Row]:
    """Rows for each kind of work and axis, for each on two threads, and of a machine's guide."""
    threads = truepose.threads()
    try:
        truepose.threads(1)
        with every_scaling() as every:
            rows = [exponent_row(scaled, times_of(scaled)) for scaled in every]
            on_threads: dict[str, Scaled] = {}
            for scaled in every:
                if scaled.axis != "closures":
                    on_threads.setdefault(scaled.work, scaled)
            rows += [_on_two_threads(scaled) for scaled in on_threads.values()]
        return [*rows, *_with_guide()]
    finally:
        truepose.threads(threads)


def times_of(scaled: Scaled) -> list[float]:
    """Seconds of a call of each size."""
    return [least_seconds(scaled.make(size)) for size in scaled.sizes]


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> tuple[float, float]:
    """Slope of log(seconds) over log(sizes), least squares, and the largest deviation from it.

    The deviation is a ratio of times, less one.
    """
    x, y = np.log(np.asarray(sizes, float)), np.log(np.asarray(seconds, float))
    slope, offset = np.polyfit(x, y, 1)
    return float(slope), float(np.expm1(np.abs(y - slope * x - offset).max()))


def exponent_row(scaled: Scaled, seconds: Sequence[float]) -> Row:
    """The fitted exponent, with its range and the times at its ends."""
    slope, deviation = exponent(scaled.sizes, seconds)
    detail = (
        f"{scaled.sizes[0]:,} to {scaled.sizes[-1]:,} {scaled.axis}: "
        + ", ".join(duration(each) for each in seconds)
        + f"; up to {100.0 * deviation:.0f} % off the fit; at the end "
        + f"{exponent(scaled.sizes[-2:], seconds[-2:])[0]:.2f}"
    )
    if scaled.why:
        detail += f"; {scaled.why}"
    asked = None if scaled.why else ASKED
    what = f"exponent of {scaled.work} in {scaled.axis}"
    return Row(what, slope, "", "at most", asked, detail)


def least_seconds(call: Call, clock: Callable[[], float] = time.process_time) -> float:
    """Seconds of one call, the least of several."""
    call()
    first = _timed(call, 1, clock)
    repeats = max(1, int(ENOUGH / max(first, 1e-9)))
    rounds = 1 if first > SLOW else ROUNDS
    return min(first, *(_timed(call, repeats, clock) for _ in range(rounds)))


def duration(seconds: float) -> str:
    """A time with three digits, in the unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{1e6 * seconds:.3g} us"


def _timed(call: Call, repeats: int, clock: Callable[[], float]) -> float:
    start = clock()
    for _ in range(repeats):
        call()
    return (clock() - start) / repeats


def _with_guide() -> list[Row]:
    """What a guide costs: machines of six closures, one of which has one."""
    rows = []
    poses, samples, moved_by = 20_000, 100_000, FEW_MOVED
    for work, make in (
        ("budget", lambda machine: budget(machine, poses)),
        ("Monte Carlo", lambda machine: monte_carlo(machine, 1, samples)),
        ("bounds", lambda machine: bounds(machine, 4)),
    ):
        plain, guided = (
            least_seconds(make(moved(name, moved_by))) for name in (CLOSURES[6], WITH_GUIDE)
        )
        detail = (
            f"{WITH_GUIDE} {duration(guided)}, {CLOSURES[6]} {duration(plain)}; a machine with a "
            f"guide goes one pose at a time, on the scalar path"
        )
        what = f"{work} of a machine with a guide, to one of six struts"
        rows.append(Row(what, guided / plain, "x", "at most", None, detail))
    return rows


def _on_two_threads(scaled: Scaled) -> Row:
    """The largest size, one thread and two in turns."""
    call = scaled.make(scaled.sizes[-1])
    best = {1: np.inf, 2: np.inf}
    for _ in range(3):
        for threads in best:
            truepose.threads(threads)
            best[threads] = min(best[threads], least_seconds(call, time.perf_counter))
    truepose.threads(1)
    detail = (
        f"{duration(best[2])} against {duration(best[1])} of wall time; "
        f"{scaled.sizes[-1]:,} {scaled.axis}"
    )
    what = f"{scaled.work}, two threads over one"
    return Row(what, best[1] / best[2], "x", "at least", None, detail)
