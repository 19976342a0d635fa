"""Designs: which values the variables of a study have together, in every variant.

A full factorial is every combination. A Latin hypercube has every variable once in each of as many
strata as there are variants; Sobol points fill the space of all variables evenly (scipy.stats.qmc).
Words are levels, and levels are strata of equal width: each is met as often as any other, or once
more.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from typing import Any

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError
from truepose.files.wording import counted, did_you_mean, one_of
from truepose.studies.varied_keys import VariedKey
from truepose.uncertainty_analysis.arguments import required_seed

FACTORIAL, LATIN_HYPERCUBE, SOBOL = "factorial", "latin-hypercube", "sobol"
DESIGNS = (FACTORIAL, LATIN_HYPERCUBE, SOBOL)

MOST_VARIANTS = 1_000_000
"""Of one study: at a few tenths of a second each they take days on one computer."""

Columns = list[tuple[list[str], Floats]]
"""Of each variable its settings and values in every variant."""


def laid_out(varied: Sequence[VariedKey], design: str, count: int | None, seed: int) -> Columns:
    """Settings and values of every variable in every variant of a design.

    `count`: how many variants, of a design that draws them; `seed`: of its random numbers.

    Raises `RequestError`: unknown-choice, bad-design, study-too-large, bad-seed, extra-missing.
    """
    if design not in DESIGNS:
        raise RequestError(
            Problem(
                "unknown-choice",
                "there is no such design of a study",
                found=f"{design}",
                expected=one_of(DESIGNS),
                hint=did_you_mean(str(design), DESIGNS),
            )
        )
    seed = required_seed(seed)
    if design == FACTORIAL:
        return _factorial(varied, count)
    size = _required_count(count, design)
    shares = points(design, size, len(varied), seed)
    return [variable.at_shares(shares[:, at]) for at, variable in enumerate(varied)]


def _factorial(varied: Sequence[VariedKey], count: int | None) -> Columns:
    """Every combination, the first variable fastest."""
    if count is not None:
        raise _bad_design(
            "a full factorial has as many variants as there are combinations",
            f"a count of {count}",
            "no count, or another design",
        )
    endless = [variable.key for variable in varied if variable.is_continuous]
    if endless:
        raise _bad_design(
            "a full factorial needs the values of each variable",
            f"{endless[0]} from one end to the other",
            "from:to:count, or a design that draws points: latin-hypercube, sobol",
        )
    sizes = [len(variable.levels) for variable in varied]
    total = math.prod(sizes)
    if total > MOST_VARIANTS:
        raise _too_large(total, " x ".join(map(str, sizes)))
    columns, repeat = [], 1
    for variable, size in zip(varied, sizes, strict=True):
        numbers = np.repeat(np.arange(size), repeat)
        repeat *= size
        columns.append(variable.at_levels(np.tile(numbers, total // repeat)))
    return columns


def _required_count(count: int | None, design: str) -> int:
    expected = f"a whole number from 1 to {MOST_VARIANTS:,}"
    if count is None:
        raise _bad_design(f"the design {design} needs a count of variants", "none", expected)
    size = operator.index(count)
    if size < 1:
        raise _bad_design("so many variants are no study", f"{size}", expected)
    if size > MOST_VARIANTS:
        raise _too_large(size, "")
    return size


def points(design: str, count: int, dimensions: int, seed: int) -> Floats:
    """(count, dimensions) shares in [0, 1). Raises `RequestError` (extra-missing)."""
    qmc = _qmc()
    if design == LATIN_HYPERCUBE:
        drawn = qmc.LatinHypercube(dimensions, rng=seed).random(count)
    else:
        # The sequence is drawn up to a power of two, for which it is balanced, and cut.
        powers = math.ceil(math.log2(count))
        drawn = qmc.Sobol(dimensions, scramble=True, rng=seed).random_base2(powers)[:count]
    points: Floats = np.clip(np.asarray(drawn, np.float64), 0.0, 1.0 - 2.0**-53)
    return points


def _qmc() -> Any:
    try:
        from scipy.stats import qmc
    except ImportError as failure:
        raise RequestError(
            Problem(
                "extra-missing",
                "this design of a study needs a package that is not installed",
                found="no scipy",
                expected="scipy",
                hint="pip install 'truepose[study]'; a full factorial needs none",
            )
        ) from failure
    return qmc


def _too_large(total: int, how: str) -> RequestError:
    return RequestError(
        Problem(
            "study-too-large",
            "more variants than a study may have",
            found=counted(total, "variant")
            if total < 1e6
            else f"{total:.3g} variants"
            if total < 1e300
            else "more than 1e300 variants",
            expected=f"at most {MOST_VARIANTS:,}",
            hint=f"{how}: take fewer values, or draw some with --design latin-hypercube --count N"
            if how
            else None,
        )
    )


def _bad_design(message: str, given: str, expected: str) -> RequestError:
    return RequestError(Problem("bad-design", message, found=given, expected=expected))


__all__ = [
    "DESIGNS",
    "FACTORIAL",
    "LATIN_HYPERCUBE",
    "MOST_VARIANTS",
    "SOBOL",
    "laid_out",
    "points",
]
