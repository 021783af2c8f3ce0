"""How the main thread waits: for an outcome, for a time, or for being asked to stop."""

from __future__ import annotations

import time
from queue import Empty, SimpleQueue
from typing import Any

from composer.runtime.tasks import Future

#: What is left of any time limit once somebody is in a hurry.
_HURRY_S = 0.05


class StopRequest:
    """Whether the system is to stop, and why.

    A signal handler may put into a SimpleQueue, but not set an Event: that takes a lock which the
    interrupted code may hold.
    """

    def __init__(self) -> None:
        self._wake: SimpleQueue[None] = SimpleQueue()
        self.reason: str | None = None
        self.hurry = False

    def ask(self, reason: str) -> None:
        """Ask for the end, from any thread or a signal handler. Asking again hurries."""
        if self.reason is None:
            self.reason = reason
        else:
            self.hurry = True
        self._wake.put(None)

    def wait(self, limit_s: float | None = None) -> None:
        """Wait until the end is asked for, for at most ``limit_s`` seconds."""
        end_s = None if limit_s is None else time.monotonic() + limit_s
        while self.reason is None and self._sleep(end_s):
            pass

    def wait_for(self, future: Future[Any], limit_s: float, *, stoppable: bool) -> bool:
        """Wait until ``future`` is done, for at most ``limit_s`` seconds, and say whether it is.

        With ``stoppable`` a request to stop ends the wait; without it a second one shortens it.
        """
        future.add_done_callback(lambda _: self._wake.put(None))
        end_s = time.monotonic() + limit_s
        while not future.done():
            if stoppable and self.reason is not None:
                break
            if self.hurry:
                end_s = min(end_s, time.monotonic() + _HURRY_S)
            if not self._sleep(end_s):
                break
        return future.done()

    def _sleep(self, end_s: float | None) -> bool:
        """Sleep until something happens; false when the time is over."""
        try:
            self._wake.get(timeout=None if end_s is None else max(0.0, end_s - time.monotonic()))
        except Empty:
            return False
        return True
