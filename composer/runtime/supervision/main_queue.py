"""What reaches the main thread: requests to stop, and things to deal with one after the other."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from composer.runtime.process.wakeup_pipe import WakeupPipe

T = TypeVar("T")

#: What is left of any time limit once somebody is in a hurry.
_HURRY_S = 0.05
#: Whoever forwards signals sends a second one beside the terminal's: no person is that quick.
_TOGETHER_S = 0.1


class MainQueue(Generic[T]):
    """Items for the main thread, whether the system is to stop, and why.

    Nothing in it takes a lock, which the code that a signal handler interrupts might hold.
    """

    def __init__(self) -> None:
        #: Rung for whatever there is to look at.
        self.bell = WakeupPipe()
        self._items: deque[T] = deque()
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
        self.bell.ring()

    def put(self, item: T) -> None:
        """Leave something to deal with, from any thread."""
        self._items.append(item)
        self.bell.ring()

    def wake(self) -> None:
        """Let a wait look again, from any thread."""
        self.bell.ring()

    def rest(self) -> list[T]:
        """Return everything that nobody has dealt with."""
        return [self._items.popleft() for _ in range(len(self._items))]

    def take(self, until_s: float | None = None) -> T | None:
        """Return the next item; None once the end is asked for, or ``time.monotonic()`` says so."""
        while not self.closing and not self._items:
            if not self.bell.wait(until_s):
                break
        return self._items.popleft() if self._items and not self.closing else None

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
            if not self.bell.wait(until_s):
                break
        return done()
