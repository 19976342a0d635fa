"""Which variants are evaluated where a study is to make a number small.

Differential evolution (Storn & Price, J. Global Optim. 11, 1997) looks over the whole space, a
generation at once, so that several processes have work; then Nelder & Mead's simplex (Computer J.
7, 1965) goes on from the best, within the bounds. Both are SciPy's, and need no derivative: the
largest error over poses has kinks. Points are shares of the way from one end of a variable to the
other.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError
from truepose.files.wording import counted
from truepose.studies.design import FACTORIAL, SOBOL, points
from truepose.studies.varied_keys import VariedKey

MOST_EVALUATIONS = 10_000
"""Each is a variant of its own in the store."""

EVOLVED = 0.7
"""Share of the evaluations in which the whole space is looked over."""

STEP, NARROWED, FINEST = 0.1, 0.5, 1e-3
"""Edge of the first simplex, a share of a variable's way; its factor each time, and the least."""


def generation_of(dimensions: int) -> int:
    """Variants of a generation: a power of two, at least five for each variable."""
    return int(max(8, 1 << (5 * dimensions - 1).bit_length()))


def require_search(varied: tuple[VariedKey, ...], count: int | None) -> int:
    """The count of evaluations of a search. Raises `RequestError` (bad-design, study-too-large)."""
    levels = [one.key for one in varied if not one.is_continuous]
    if levels:
        raise _bad(
            "an optimiser needs variables that have any value between two ends",
            f"{levels[0]} with some values only",
            "from:to with a unit, as in 30:120 N/um; make a study of each of the words",
        )
    least = 2 * generation_of(len(varied))
    if count is None or count < least:
        raise _bad(
            f"an optimiser of {counted(len(varied), 'variable')} needs more evaluations",
            "none" if count is None else str(count),
            f"--count of at least {least}, better {5 * least}",
        )
    if count > MOST_EVALUATIONS:
        raise RequestError(
            Problem(
                "study-too-large",
                "more evaluations than a search may have",
                found=f"{count:,}",
                expected=f"at most {MOST_EVALUATIONS:,}",
            )
        )
    return count


def require_no_design(design: str) -> None:
    """Refuse a design beside an optimiser. Raises `RequestError` (bad-design)."""
    if design != FACTORIAL:  # what stands where none is given
        raise _bad("an optimiser draws the variants itself", f"the design {design}", "no design")


def _bad(message: str, given: str, expected: str) -> RequestError:
    return RequestError(Problem("bad-design", message, found=given, expected=expected))


class _UsedUpError(Exception):
    """All evaluations are made."""


class _Counted:
    """Counts what is asked, and knows the best."""

    def __init__(self, ask: Callable[[Floats], Floats], count: int) -> None:
        self._ask, self.left = ask, count
        self.best: tuple[float, Floats] | None = None

    def __call__(self, shares: Floats) -> Floats:
        if len(shares) > self.left:
            raise _UsedUpError
        self.left -= len(shares)
        values = self._ask(shares)
        at = int(values.argmin())
        if self.best is None or values[at] < self.best[0]:
            self.best = float(values[at]), shares[at].copy()
        return values


def search(ask: Callable[[Floats], Floats], dimensions: int, count: int, seed: int) -> None:
    """Ask for the values (m,) at shares (m, dimensions) in [0, 1], `count` of them in all.

    The same points in the same order, where the same values are answered.
    """
    from scipy.optimize import differential_evolution

    size = generation_of(dimensions)
    asked = _Counted(ask, count)
    first = points(SOBOL, size, dimensions, seed)
    generations = max(int(EVOLVED * count) // size - 1, 1)
    try:
        differential_evolution(
            lambda shares: asked(np.ascontiguousarray(shares.T)),
            [(0.0, 1.0)] * dimensions,
            init=first,
            maxiter=generations,
            tol=0.0,
            rng=seed,
            polish=False,
            vectorized=True,
            updating="deferred",
        )
        step = STEP
        while asked.left:
            _simplex(asked, dimensions, step)
            step = max(NARROWED * step, FINEST)
    except _UsedUpError:
        return


def _simplex(asked: _Counted, dimensions: int, step: float) -> None:
    """Go down from the best point that is known."""
    from scipy.optimize import minimize

    assert asked.best is not None
    start = asked.best[1]
    inwards = np.where(start < 0.5, step, -step)
    simplex = np.vstack([start, start + np.diag(inwards)])
    options: dict[str, Any] = {
        "initial_simplex": simplex,
        "xatol": 0.1 * step,
        "fatol": np.inf,
        "maxfev": asked.left,
    }
    minimize(
        lambda shares: float(asked(np.asarray(shares, np.float64)[np.newaxis])[0]),
        start,
        method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * dimensions,
        options=options,
    )


__all__ = ["generation_of", "require_no_design", "require_search", "search"]
