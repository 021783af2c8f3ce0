"""What reaches the main thread: requests to stop, and things to deal with one after the other."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Generic, TypeVar

T = TypeVar("T")

#: What is left of any time limit once somebody is in a hurry.
_HURRY_S = 0.05
#: Whoever forwards signals sends a second one beside the terminal's: no person is that quick.
_TOGETHER_S = 0.1


class Inbox(Generic[T]):
    """Items for the main thread, whether the system is to stop, and why.

    A signal handler may put into a SimpleQueue, but not set an Event: that takes a lock which the
    interrupted code may hold.
    """

    def __init__(self) -> None:
        self._news: SimpleQueue[T | None] = SimpleQueue()  # None: look whether anything is done
        self._waiting: deque[T] = deque()
        self.reason: str | None = None
        self.hurry = False
        self._asked_s = 0.0

    @property
    def closing(self) -> bool:
        """Whether the end was asked for."""
        return self.reason is not None

    def ask(self, reason: str) -> None:
        """Ask for the end, from any thread or a signal handler. Asking again, later, hurries."""
        now_s = time.monotonic()
        if self.reason is None:
            self.reason = reason
            self._asked_s = now_s
        elif now_s - self._asked_s > _TOGETHER_S:
            self.hurry = True
        self._news.put(None)

    def put(self, item: T) -> None:
        """Leave something to deal with, from any thread."""
        self._news.put(item)

    def wake(self) -> None:
        """Let a wait look again, from any thread."""
        self._news.put(None)

    def rest(self) -> list[T]:
        """Return everything that nobody has dealt with."""
        while self._receive(0.0):
            pass
        left = list(self._waiting)
        self._waiting.clear()
        return left

    def take(self, until_s: float | None = None) -> T | None:
        """Return the next item; None once the end is asked for, or ``time.monotonic()`` says so."""
        while not self.closing and not self._waiting:
            if not self._receive(until_s):
                return None
        return self._waiting.popleft() if self._waiting and not self.closing else None

    def wait(self, done: Callable[[], bool], until_s: float, *, stoppable: bool) -> bool:
        """Wait until ``done()``, at most until ``time.monotonic()`` says so; return whether it is.

        With ``stoppable`` a request to stop ends the wait; without it a second one shortens it.
        Items that come meanwhile are kept.
        """
        while not done():
            if stoppable and self.closing:
                break
            if self.hurry:
                until_s = min(until_s, time.monotonic() + _HURRY_S)
            if not self._receive(until_s):
                break
        return done()

    def _receive(self, until_s: float | None) -> bool:
        """Sleep until something happens; false when the time is over."""
        try:
            left_s = None if until_s is None else max(0.0, until_s - time.monotonic())
            item = self._news.get(timeout=left_s)
        except Empty:
            return False
        if item is not None:
            self._waiting.append(item)
        return True
