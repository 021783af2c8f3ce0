"""The time of a run: that of the computer, or virtual time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from typing import TYPE_CHECKING

from composer.cli.support.errors import UsageError

if TYPE_CHECKING:
    from composer.runtime.clock.clock import Clock


class Time(StrEnum):
    """The values of ``--time``."""

    REAL = "real"
    VIRTUAL = "virtual"


def run_clock(
    time: Time,
    run_for_s: float | None,
    speed: float | None,
    *,
    publish_clock: bool,
    used: Mapping[str, bool],
) -> Clock:
    """Return the clock of a run.

    ``used`` says which options that need other processes are given. Raises UsageError for options
    that have no meaning together.
    """
    from composer.runtime.clock.clock import COMPUTER
    from composer.runtime.clock.virtual import VirtualClock

    if time is Time.REAL:
        for option, is_given in {"--speed": speed, "--publish-clock": publish_clock}.items():
            if is_given:
                raise UsageError(f"{option} needs --time virtual")
        return COMPUTER
    if run_for_s is None and speed is None:
        raise UsageError("--time virtual needs --for or --speed: the time would run away")
    for option in (option for option, is_given in used.items() if is_given):
        raise UsageError(
            f"{option} cannot be used with --time virtual: the run takes part in nothing outside"
            " of its process",
            hint="add --publish-clock" if option == "--dashboard" else None,
        )
    return VirtualClock(math.inf if speed is None else speed, is_isolated=not publish_clock)
