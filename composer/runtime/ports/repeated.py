"""What may happen again and again: told at once, and summed up for as long as it goes on."""

from __future__ import annotations

from collections.abc import Callable

from composer.runtime.callbacks.log import Log
from composer.runtime.executors.tasks import Cancellable, Clock

#: What goes on all the time is told once in so long.
AGAIN_AFTER_S = 10.0


class Repeated:
    """Warns of one thing."""

    def __init__(self, log: Log, clock: Clock, text: Callable[[], str]) -> None:
        """``text()`` says what happened; it is asked for when that is told."""
        self._log = log
        self._clock = clock
        self._text = text
        self._untold = 0
        self._timer: Cancellable | None = None

    def take(self, number: int) -> None:
        """Warn that it happened so many times, or count it where that was told just now."""
        self._untold += number
        if self._timer is not None:
            return
        self._untold -= 1
        self._log.warn(self._text())
        self._timer = self._clock.call_later(AGAIN_AFTER_S, self._sum_up)

    def close(self) -> None:
        """Say nothing more."""
        if self._timer is not None:
            self._timer.cancel()

    def _sum_up(self) -> None:
        self._timer = None
        if self._untold:
            times, self._untold = self._untold, 0
            self._log.warn(f"{self._text()} ({times} times more within {AGAIN_AFTER_S:g} s)")
            self._timer = self._clock.call_later(AGAIN_AFTER_S, self._sum_up)
