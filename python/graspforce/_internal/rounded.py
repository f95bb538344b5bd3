"""Numbers for people: as many digits as are proven."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal


def proven(value: float, width: float) -> str:
    """Write a number whose error is at most `width`: as many digits as are certain, nine at most."""
    size = abs(value)
    known = math.log10(size) - math.log10(width) if 0 < size < math.inf and 0 < width < math.inf else 9.0
    return f"{value + 0.0:.{min(max(math.floor(known) + 1, 1), 9)}g}"


def outward(lower: float, upper: float) -> tuple[str, str]:
    """Write the ends of a bracket with few digits, rounded outward, so that different ends look different."""
    width = upper - lower
    if not 0 < width < math.inf:
        return f"{lower + 0.0:.6g}", f"{upper + 0.0:.6g}"
    digits = min(max(math.ceil(math.log10(max(abs(lower), abs(upper)) / width)) + 2, 3), 15)
    ends = ((lower, ROUND_FLOOR), (upper, ROUND_CEILING))
    low, high = (Context(prec=digits, rounding=way).create_decimal(Decimal(end)) for end, way in ends)
    return f"{float(low) + 0.0:.{digits}g}", f"{float(high) + 0.0:.{digits}g}"
