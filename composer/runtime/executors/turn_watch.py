"""Watches for callbacks of classes that block, and lets other threads serve their loops."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable

from composer.runtime.executors.loop import Loop

#: A callback blocks if it keeps its loop for one of these periods after it was noticed.
_PERIOD_S = 0.02
#: The watch looks less often while it meets no callback: each look costs 30 us of CPU.
_LONGEST_PERIOD_S = 0.1


class TurnWatch:
    """A thread that takes the turn away from callbacks that block.

    The callbacks themselves need not do anything, so that it costs nothing to call one.
    """

    def __init__(self, loops: Callable[[], Iterable[Loop]]) -> None:
        self._loops = loops
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="turn watch", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Stop the thread."""
        self._end.set()

    def _run(self) -> None:
        period_s = _PERIOD_S
        while not self._end.wait(period_s):
            is_calling = [loop.hand_over_blocked() for loop in tuple(self._loops())]
            period_s = _PERIOD_S if any(is_calling) else min(2 * period_s, _LONGEST_PERIOD_S)
