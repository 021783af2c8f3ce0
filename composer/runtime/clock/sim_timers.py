"""Calls at a time that somebody else tells: the timers of a node in simulated time.

Counted in whole nanoseconds, as rcl does: a simulator's steps are the very multiples of the periods
that timers wait for, and sums of fractions would miss them by a hair.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from functools import partial
from typing import Protocol

NANOSECONDS = 1_000_000_000
_NEVER = math.inf


class Caller(Protocol):
    """The part of a loop that is needed here."""

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""


class SimulatedCall:
    """A call that is due ``delay_ns`` after it was asked for, and every so often if ``repeats``."""

    __slots__ = ("_calls", "callback", "cancelled", "delay_ns", "due_ns", "repeats")

    def __init__(
        self,
        calls: SimulatedCalls,
        delay_s: float,
        callback: Callable[[], object],
        *,
        repeats: bool,
    ) -> None:
        """Raise ValueError for a period that is not positive and a delay that is no number."""
        if repeats and not delay_s > 0:
            raise ValueError(f"a period must be positive, not {delay_s:g} s")
        if math.isnan(delay_s):
            raise ValueError("a delay must be a number")
        self._calls = calls
        self.delay_ns: float = (
            max(round(delay_s * NANOSECONDS), int(repeats)) if math.isfinite(delay_s) else delay_s
        )
        self.due_ns: float = 0
        self.callback = callback
        self.repeats = repeats
        self.cancelled = False

    @property
    def late_s(self) -> float:
        """How long ago the call was due, in seconds of the simulation."""
        return (self._calls.now_ns - self.due_ns) / NANOSECONDS

    def cancel(self) -> None:
        """Never call again."""
        self.cancelled = True
        self._calls.forget(self)


class SimulatedCalls:
    """The calls of one node; few, so that no heap is needed. From any thread.

    Time goes on only when it is told. What the calls do when it jumps:

    - forward: what is due by then is called once, however many periods went by;
    - backward: nothing is waited for longer than its whole period or delay from the new time on
      (rcl/src/rcl/timer.c, ``_rcl_timer_time_jump``);
    - from zero, which is no time yet: all delays begin.
    """

    def __init__(self, loop: Caller) -> None:
        """Call on ``loop``."""
        self._loop = loop
        self._changing = threading.Lock()
        self._waiting: set[SimulatedCall] = set()
        self._next_ns: float = _NEVER
        self.now_ns = 0

    def add(
        self, delay_s: float, callback: Callable[[], object], *, repeats: bool = False
    ) -> SimulatedCall:
        """Call ``callback`` ``delay_s`` seconds of the simulation from now."""
        call = SimulatedCall(self, delay_s, callback, repeats=repeats)
        if call.delay_ns <= 0:
            self._loop.call_soon(partial(self._call, call))
            return call
        with self._changing:
            self._wait_for(call, self.now_ns + call.delay_ns)
        return call

    def forget(self, call: SimulatedCall) -> None:
        """Wait for a call no more."""
        with self._changing:
            self._waiting.discard(call)

    def take_time(self, now_ns: int) -> None:
        """Have everything called that is due by ``now_ns``."""
        with self._changing:
            before_ns, self.now_ns = self.now_ns, now_ns
            if before_ns == 0:
                self._wait_anew(lambda call: now_ns + call.delay_ns)
            elif now_ns < before_ns:
                self._wait_anew(lambda call: min(call.due_ns, now_ns + call.delay_ns))
            due = self._take_due() if now_ns >= self._next_ns else ()
        for call in due:
            self._loop.call_soon(partial(self._call, call))

    def _wait_for(self, call: SimulatedCall, due_ns: float) -> None:
        call.due_ns = due_ns
        self._waiting.add(call)
        self._next_ns = min(self._next_ns, due_ns)

    def _wait_anew(self, due_ns: Callable[[SimulatedCall], float]) -> None:
        self._next_ns = _NEVER
        for call in self._waiting:
            self._wait_for(call, due_ns(call))

    def _take_due(self) -> list[SimulatedCall]:
        now_ns = self.now_ns
        due = sorted(
            (call for call in self._waiting if call.due_ns <= now_ns), key=lambda call: call.due_ns
        )
        self._waiting.difference_update(due)
        self._next_ns = min((call.due_ns for call in self._waiting), default=_NEVER)
        return due

    def _call(self, call: SimulatedCall) -> None:
        if call.cancelled:
            return
        try:
            call.callback()
        finally:
            if call.repeats:
                self._repeat(call)

    def _repeat(self, call: SimulatedCall) -> None:
        """Wait for the next multiple of the period that is still to come."""
        with self._changing:
            if call.cancelled:
                return
            late_ns = self.now_ns - call.due_ns
            if late_ns < 0:  # time has jumped back since it was due
                self._wait_for(call, self.now_ns + call.delay_ns)
            else:
                self._wait_for(call, call.due_ns + (late_ns // call.delay_ns + 1) * call.delay_ns)
