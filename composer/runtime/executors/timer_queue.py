"""Calls scheduled at times of the steady clock."""

from __future__ import annotations

import itertools
from bisect import insort
from collections.abc import Callable
from math import floor, inf, isnan
from time import monotonic

_SWEEP_SIZE = 64  # entries at which canceled calls are removed


class ScheduledCall:
    """A call that is due at ``due_s``, and each ``period_s`` seconds after that if it has one."""

    __slots__ = ("callback", "cancelled", "due_s", "period_s")

    def __init__(
        self, due_s: float, period_s: float | None, callback: Callable[[], object]
    ) -> None:
        """Raise ValueError for a period that is not positive and a time that is NaN."""
        if period_s is not None and not period_s > 0:
            raise ValueError(f"a period must be positive, not {period_s:g} s")
        if isnan(due_s):
            raise ValueError("a delay must be a number")
        self.due_s = due_s
        self.period_s = inf if period_s is None else period_s
        self.callback = callback
        self.cancelled = False

    @property
    def late_s(self) -> float:
        """How long ago the call was due, in seconds."""
        return monotonic() - self.due_s

    def cancel(self) -> None:
        """Never call again."""
        self.cancelled = True


class TimerQueue:
    """Scheduled calls, for use by one thread.

    A sorted list with the next call last, not a heap: taking that call and, if there are few,
    inserting it again needs no search. A periodic call is inserted again each time.
    """

    def __init__(self) -> None:
        self._entries: list[tuple[float, int, ScheduledCall]] = []  # ascending: -due_s, -order
        self._order = itertools.count(0, -1)  # calls due at the same time keep their order
        self._sweep_at = _SWEEP_SIZE
        self.next_s = inf  # no call is due before; possibly that of a canceled call

    def add(self, call: ScheduledCall) -> None:
        """Add a call."""
        self._insert(call)
        self.next_s = min(self.next_s, call.due_s)

    def next_due_s(self) -> float:
        """Return when the next call is due; infinity if there is none."""
        entries = self._entries
        while entries and entries[-1][2].cancelled:
            entries.pop()
        self.next_s = -entries[-1][0] if entries else inf
        return self.next_s

    def pop(self) -> ScheduledCall:
        """Remove and return the next call, even a canceled one. Raises IndexError if empty.

        Until :meth:`reschedule`, ``next_s`` includes the next time of a periodic call.
        """
        entries = self._entries
        call = entries.pop()[2]
        self.next_s = call.due_s + call.period_s
        if entries and -entries[-1][0] < self.next_s:
            self.next_s = -entries[-1][0]
        return call

    def reschedule(self, call: ScheduledCall) -> None:
        """Add a periodic call again for the next multiple of its period in the future.

        A late call does not shift the next one; missed periods are skipped.
        """
        period_s = call.period_s
        if period_s != inf and not call.cancelled:
            due_s = call.due_s + period_s
            late_s = monotonic() - due_s
            if late_s >= 0.0:
                due_s += (floor(late_s / period_s) + 1) * period_s
            call.due_s = due_s
            self._insert(call)
        entries = self._entries
        self.next_s = -entries[-1][0] if entries else inf

    def _insert(self, call: ScheduledCall) -> None:
        entries = self._entries
        if len(entries) >= self._sweep_at:
            self._sweep()
        entry = (-call.due_s, next(self._order), call)
        if not entries or entries[-1] < entry:
            entries.append(entry)
        else:
            insort(entries, entry)

    def _sweep(self) -> None:
        self._entries[:] = [entry for entry in self._entries if not entry[2].cancelled]
        self._sweep_at = max(_SWEEP_SIZE, 2 * len(self._entries))
