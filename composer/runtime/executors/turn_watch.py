"""Watches for callbacks of classes that block, and lets other threads serve their loops."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable

from composer.runtime.executors.loop import Loop

#: A callback blocks if it keeps its loop for one to two of these periods.
_PERIOD_S = 0.02


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
        while not self._end.wait(_PERIOD_S):
            for loop in tuple(self._loops()):
                loop.hand_over_blocked()
