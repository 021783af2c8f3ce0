"""What all options that take a number of seconds, or another measure, have in common."""

from __future__ import annotations

import typer

#: Some thirty years, in seconds. Clocks of the system count to that, and to no infinity.
_LARGEST = 1e9


def finite(value: float | None) -> float | None:
    """Return an option's value; refuse what no clock can count to, infinity and NaN among it."""
    if value is not None and not value <= _LARGEST:
        raise typer.BadParameter(f"{value:g} is not in the range x<={_LARGEST:g}.")
    return value
