"""How likely a ratio of two mean squares is: the upper tail of Fisher's F distribution.

By the regularised incomplete beta function, from its continued fraction (DLMF 8.17.22, evaluated
after Lentz 1976): P(F > f) = I_x(b/2, a/2), x = b / (b + a f), for a and b degrees of freedom.
"""

from __future__ import annotations

import math

STEPS, ENOUGH, TINY = 300, 1e-15, 1e-300


def f_tail(value: float, numerator: float, denominator: float) -> float:
    """Probability that the ratio is above `value`, for so many degrees of freedom, above zero."""
    if not value > 0.0:
        return 1.0
    a, b = 0.5 * denominator, 0.5 * numerator
    share = denominator / (denominator + numerator * value)
    return _incomplete_beta(a, b, share)


def _incomplete_beta(a: float, b: float, x: float) -> float:
    """I_x(a, b), 0 <= x <= 1."""
    if x > (a + 1.0) / (a + b + 2.0):  # where the fraction converges slowly
        return 1.0 - _incomplete_beta(b, a, 1.0 - x)
    if x <= 0.0:
        return 0.0
    log_front = (
        math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)
    )
    return math.exp(log_front) / a * _fraction(a, b, x)


def _fraction(a: float, b: float, x: float) -> float:
    ratio = 1.0 - (a + b) * x / (a + 1.0)
    down = 1.0 / (ratio if abs(ratio) > TINY else TINY)
    up, value = 1.0, down
    for step in range(1, STEPS):
        even = step * (b - step) * x / ((a + 2 * step - 1) * (a + 2 * step))
        odd = -(a + step) * (a + b + step) * x / ((a + 2 * step) * (a + 2 * step + 1))
        change = 1.0
        for term in (even, odd):
            down = 1.0 + term * down
            up = 1.0 + term / up
            down = 1.0 / (down if abs(down) > TINY else TINY)
            up = up if abs(up) > TINY else TINY
            change = down * up
            value *= change
        if abs(change - 1.0) < ENOUGH:
            break
    return value


__all__ = ["f_tail"]
