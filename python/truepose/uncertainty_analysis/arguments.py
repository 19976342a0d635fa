"""Numbers that a request gives besides poses, checked."""

from __future__ import annotations

import operator

import numpy as np

from truepose.errors import Problem, RequestError
from truepose.files.limits import MOST_SAMPLES

SEEDS = 2**64
"""How many seeds there are."""

DIGITS = 1
"""Significant digits of a standard uncertainty that are made stable where nobody says how many.

A second one takes a hundred times as many samples.
"""

MOST_DIGITS = range(1, 7)
"""Significant digits of a standard uncertainty that can be asked for."""


def required_probability(probability: float) -> float:
    """The coverage probability asked for. Raises `RequestError` (bad-probability)."""
    fine = isinstance(probability, float | int | np.number)
    if fine and 0.0 < probability < 1.0:
        return float(probability)
    raise RequestError(
        Problem(
            "bad-probability",
            "a coverage interval of this probability does not exist",
            found=f"{probability}",
            expected="a number between 0 and 1, such as 0.95",
            hint=f"{probability:g} % is {probability / 100:g}"
            if fine and 1 < probability < 1e6
            else None,
        )
    )


def required_digits(digits: int) -> int:
    """The significant digits of a standard uncertainty. Raises `RequestError` (bad-digits)."""
    if digits in MOST_DIGITS and not isinstance(digits, bool):
        return int(digits)
    raise RequestError(
        Problem(
            "bad-digits",
            "a standard uncertainty is not stated with so many significant digits",
            found=f"{digits}",
            expected=f"{MOST_DIGITS.start} to {MOST_DIGITS.stop - 1}; one or two is usual",
        )
    )


def required_samples(samples: int, least: int, most: int = MOST_SAMPLES) -> int:
    """The number of samples, from `least` to `most`. Raises `RequestError` (bad-samples)."""
    try:
        count = operator.index(samples)
    except TypeError:
        count = 0
    if least <= count <= most:
        return count
    if count > most:
        raise RequestError(
            Problem(
                "bad-samples",
                "nobody waits for so many samples",
                found=f"{samples:.3g}" if count < 1e300 else "a number of more than 300 digits",
                expected=f"at most {most:,}",
                hint="without the number there are as many as are needed",
            )
        )
    raise RequestError(
        Problem(
            "bad-samples",
            "nothing can be estimated from so many samples",
            found=f"{samples!r}",
            expected=f"a whole number, {least} or more",
            hint="without the number there are as many as are needed",
        )
    )


def required_seed(seed: int) -> int:
    """The seed. Raises `RequestError` (bad-seed)."""
    try:
        number = operator.index(seed)
    except TypeError:
        number = -1
    if 0 <= number < SEEDS:
        return number
    raise RequestError(
        Problem(
            "bad-seed",
            "this is no seed of random numbers",
            found=f"{seed!r}",
            expected="a whole number from 0 to 2^64 - 1",
        )
    )
