"""The exact confidence interval of a probability, by Clopper and Pearson.

C. J. Clopper and E. S. Pearson, "The use of confidence or fiducial limits illustrated in the case of the
binomial", Biometrika 26 (1934) 404-413.
"""

from __future__ import annotations

import math

__all__ = ["binomial_interval"]

_STEPS = 300  # of the continued fraction for a million trials: it needs some square root of them
_HALVINGS = 80


def binomial_interval(successes: int, trials: int, confidence: float) -> tuple[float, float]:
    """Return the ends of the interval that holds the probability with at least this confidence.

    With the probability at the lower end, as many successes or more have the probability
    ``(1 - confidence) / 2``; with that at the upper end, as many or fewer. No successes make the lower end 0,
    and nothing but successes the upper one 1.
    """
    tail = (1 - confidence) / 2
    failures = trials - successes
    lower = 0.0 if successes == 0 else _quantile(tail, successes, failures + 1)
    upper = 1.0 if failures == 0 else 1 - _quantile(tail, failures, successes + 1)
    return lower, upper


def _quantile(share: float, a: int, b: int) -> float:
    """Where the regularised incomplete beta function is this share, from below."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if _beta(middle, a, b) <= share:
            low = middle
        else:
            high = middle
    return low


def _beta(x: float, a: int, b: int) -> float:
    """Return the regularised incomplete beta function by its continued fraction, as Lentz evaluates it."""
    if x <= 0 or x >= 1:
        return float(x >= 1)
    if x > (a + 1) / (a + b + 2):
        return 1 - _beta(1 - x, b, a)
    front = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)
    tiny = 1e-300
    c, d = 1.0, 1 / (1 - (a + b) * x / (a + 1) or tiny)
    value = d
    for step in range(1, _STEPS + int(4 * math.sqrt(a + b))):
        before = value
        for term in (
            step * (b - step) * x / ((a + 2 * step - 1) * (a + 2 * step)),
            -(a + step) * (a + b + step) * x / ((a + 2 * step) * (a + 2 * step + 1)),
        ):
            d = 1 / (1 + term * d or tiny)
            c = 1 + term / c or tiny
            value *= c * d
        if abs(value - before) <= 1e-16 * abs(value):
            break
    return math.exp(front) * value / a
