"""Numbers in reports, which may be those of any node."""

from __future__ import annotations

import math


def finite(text: str) -> float:
    """Return a number. Raises ValueError, also for infinity and NaN."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"'{text:.80}' is not a number")
    return number


def whole(text: str) -> int:
    """Return an integer. Raises ValueError."""
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"'{text:.80}' is not an integer") from None


def optional_text(number: float | None, digits: int) -> str:
    """Return a number as text with some digits after the point; empty if it is not known."""
    return "" if number is None else f"{number:.{digits}f}"


def optional(text: str) -> float | None:
    """Return the number of :func:`optional_text`. Raises ValueError."""
    return finite(text) if text else None
