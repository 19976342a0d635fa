"""From the times of two commits to lines that say by how much one is quicker, and how equal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.works import Results, Work

EQUAL = 1e-12
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
MIB = 2**20
SAME_PEAK = 0.98
"""Of peak memory before over after: two runs of one commit differ by one part in a hundred."""
TEN_OVER_THREE = 2.0
"""What ten sources may cost at most, over three."""


@dataclass
class Side:
    """What one commit took for one piece of work, in several processes."""

    seconds: list[float] = field(default_factory=list)
    peaks: list[float] = field(default_factory=list)
    """Peak memory of each process, bytes."""
    missing: str = ""
    """Why the work cannot be done."""

    def take(self, answer: Mapping[str, object]) -> None:
        """Keep what a process answered."""
        if "missing" in answer:
            self.missing = str(answer["missing"])
        else:
            self.seconds.append(float(str(answer["seconds"])))
            self.peaks.append(float(str(answer["peak"])))


@dataclass(frozen=True)
class Agreement:
    """How far two commits' results are from one another."""

    said: str
    kept: bool
    """Whether they are as equal as was asked."""


def difference(after: NDArray, before: NDArray) -> float:
    """Largest difference over the largest number; infinite where NaN, infinities or shapes differ.

    Of nothing but zeros and what is not finite it is 0.
    """
    if after.shape != before.shape:
        return np.inf
    finite = np.isfinite(before)
    if not np.array_equal(after[~finite], before[~finite], equal_nan=True):
        return np.inf
    gaps = np.abs(after[finite] - before[finite])
    if not np.isfinite(gaps).all():
        return np.inf
    scale = np.abs(before[finite]).max(initial=0.0)
    return float(gaps.max(initial=0.0) / scale) if scale else float(np.inf if gaps.any() else 0.0)


def agreement(work: Work, before: Results, after: Results) -> Agreement:
    """Results of the same names compared: equal to 1e-12, or a bound that may be so much wider."""
    no_more = work.no_more or {}
    common = [name for name in before if name in after]
    gaps = {name: difference(after[name], before[name]) for name in common if name not in no_more}
    worst = max(gaps, key=lambda name: gaps[name], default="")
    gap = gaps.get(worst, 0.0)
    kept = gap <= EQUAL or bool(work.incomparable)
    said = f"equal to {gap:.1e}" if gap <= EQUAL else f"differ by {gap:.1e} ({worst})"
    if gap > EQUAL and work.incomparable:
        said += f": {work.incomparable}"
    for name in (name for name in common if name in no_more):
        ratio = after[name] / before[name]
        said += f"; {name} {ratio.min():.6f} to {ratio.max():.6f} x"
        kept &= bool((ratio <= no_more[name]).all())
    for names, where in ((before, "before"), (after, "after")):
        if alone := [name for name in names if name not in common]:
            said += f"; only {where}: {', '.join(alone)}"
    return Agreement(said, kept)


def lines(
    work: Work, before: Side, after: Side, equality: Agreement
) -> list[tuple[tuple[str, ...], bool]]:
    """Cells of each line (figure, before, after, ratio, asked, met or missed, results), and if met.

    The figure is processor time, and peak memory where that is meant too. Of what one side does not
    have there is no ratio.
    """
    if before.missing or after.missing:
        sides = (("before", before), ("after", after))
        said = "; ".join(
            f"not there {which}: {side.missing}" for which, side in sides if side.missing
        )
        cells = [_time(work, side) if not side.missing else "" for _, side in sides]
        return [((work.what, *cells, "", "", "", said), not after.missing)]
    ratio = min(before.seconds) / min(after.seconds)
    asked, verdict, met = _judged(ratio, work.asked)
    times = _time(work, before), _time(work, after)
    rows = [((work.what, *times, f"{ratio:.3g} x", asked, verdict, equality.said), met)]
    if work.memory:
        peaks = min(before.peaks), min(after.peaks)
        shown = (f"{peak / MIB:.0f} MiB" for peak in peaks)
        asked, verdict, met = _judged(peaks[0] / peaks[1], SAME_PEAK)
        figure = f"{work.what}, peak memory"
        rows.append(((figure, *shown, f"{peaks[0] / peaks[1]:.3g} x", asked, verdict, ""), met))
    return [(cells, met and equality.kept) for cells, met in rows]


def ten_over_three(
    ten: tuple[Side, Side], three: tuple[Side, Side]
) -> list[tuple[tuple[str, ...], bool]]:
    """The line of how much more ten sources cost than three, on each side."""
    if any(side.missing for side in (*ten, *three)):
        return []
    before, after = (
        min(more.seconds) / min(fewer.seconds) for more, fewer in zip(ten, three, strict=True)
    )
    met = after <= TEN_OVER_THREE
    shown = (f"{before:.3g} x", f"{after:.3g} x", f"{before / after:.3g} x")
    asked = f"at most {TEN_OVER_THREE:g} x after"
    verdict = "met" if met else "**missed**"
    return [(("ten sources over three, same machine", *shown, asked, verdict, ""), met)]


def _judged(ratio: float, asked: float | None) -> tuple[str, str, bool]:
    if asked is None:
        return "", "", True
    met = ratio >= asked
    return f"at least {asked:g} x", "met" if met else "**missed**", met


def _time(work: Work, side: Side) -> str:
    return f"{min(side.seconds) / SECONDS[work.unit]:.3g} {work.unit}"


def spread(seconds: Sequence[float]) -> float:
    """Median over least: how much the machine was disturbed."""
    return float(np.median(seconds) / min(seconds))
