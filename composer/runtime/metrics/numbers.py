"""Numbers in reports, which may be those of any node."""

from __future__ import annotations

import math


def finite(text: str) -> float:
    """Return a number. Raises ValueError, also for infinity and NaN."""
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"'{text}' is not a number")
    return number
