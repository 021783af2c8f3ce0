"""Timers for a loop that cannot wait for a point in time itself."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from time import monotonic
from typing import Protocol

from composer.runtime.executors.tasks import name_of
from composer.runtime.executors.timer_queue import ScheduledCall, TimerQueue


class CallRunner(Protocol):
    """The part of a loop that timers need."""

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""

    def call(self, name: Callable[[], str], callback: Callable[[], object]) -> None:
        """Call ``callback`` on the current thread and report its exception."""


class TimerThread:
    """Passes calls to a loop when they are due; a periodic one again only after it was made."""

    def __init__(self, loop: CallRunner, name: str) -> None:
        self._loop = loop
        self._timers = TimerQueue()
        self._changed = threading.Condition()
        self._stopping = False
        self.thread = threading.Thread(target=self._run, name=name, daemon=True)

    def add(self, call: ScheduledCall) -> ScheduledCall:
        """Pass ``call`` to the loop when it is due. From any thread."""
        with self._changed:
            self._timers.add(call)
            self._changed.notify()
        return call

    def start(self) -> None:
        """Start the thread."""
        self.thread.start()

    def stop(self) -> None:
        """Stop passing calls to the loop."""
        with self._changed:
            self._stopping = True
            self._changed.notify()

    def _run(self) -> None:
        while True:
            with self._changed:
                if self._stopping:
                    return
                remaining_s = self._timers.next_due_s() - monotonic()
                if remaining_s > 0.0:
                    self._changed.wait(min(remaining_s, threading.TIMEOUT_MAX))
                    continue
                call = self._timers.pop()
            self._loop.call_soon(partial(self._call, call))

    def _call(self, call: ScheduledCall) -> None:
        if call.cancelled or self._stopping:
            return
        self._loop.call(partial(name_of, call.callback), call.callback)
        with self._changed:
            self._timers.reschedule(call)
            self._changed.notify()
