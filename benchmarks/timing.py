"""Best-of-several times, and the agreement without which no time is told."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

AGREEMENT = 1e-12


class DisagreementError(AssertionError):
    """Two ways of the same work gave different results, so their times say nothing."""


def require_agreement(what: str, ours: NDArray[np.float64], peer: NDArray[np.float64]) -> None:
    """Raises unless both are equal to 1e-12 (m, rad; relative where the numbers are above 1)."""
    if ours.shape != peer.shape:
        raise DisagreementError(f"{what}: shape {ours.shape} against {peer.shape}")
    scale = max(1.0, float(np.abs(peer).max()))
    gap = float(np.abs(ours - peer).max()) / scale
    if not gap <= AGREEMENT:
        raise DisagreementError(f"{what}: differ by {gap:.3g}, more than {AGREEMENT:g}")


def best_seconds(
    calls: Mapping[str, Callable[[], object]],
    *,
    rounds: int,
    repeats: Mapping[str, int] | None = None,
    clock: Callable[[], float] = time.process_time,
) -> dict[str, float]:
    """Seconds of one call of each, the best of `rounds`, taking turns in all weathers.

    `repeats` says how often a short call is repeated inside one timing. The default clock counts
    the processor time of this process.
    """
    best = dict.fromkeys(calls, float("inf"))
    for call in calls.values():
        call()
    for _ in range(rounds):
        for name, call in calls.items():
            count = (repeats or {}).get(name, 1)
            start = clock()
            for _ in range(count):
                call()
            best[name] = min(best[name], (clock() - start) / count)
    return best
