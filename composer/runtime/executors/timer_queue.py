"""Calls at a time of the steady clock."""

from __future__ import annotations

import itertools
from bisect import insort
from collections.abc import Callable
from math import floor, inf, isnan
from time import monotonic

_MANY = 64  # cancelled calls that may linger before they are swept out


class ScheduledCall:
    """A call that is due at ``due_s``, and each ``period_s`` after that where there is one."""

    __slots__ = ("callback", "cancelled", "due_s", "period_s")

    def __init__(
        self, due_s: float, period_s: float | None, callback: Callable[[], object]
    ) -> None:
        """Raise ValueError for a period that is not positive and a time that is no number."""
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


class Timetable:
    """Scheduled calls. To be used by one thread.

    A sorted list, the next call last, and no heap: to take that one out and, where there are few,
    to put it back is no search then, and a call has to be put back each time it was made.
    """

    def __init__(self) -> None:
        self._entries: list[tuple[float, int, ScheduledCall]] = []  # -due_s, -place, call
        self._places = itertools.count(0, -1)  # calls due at the same time keep their order
        self._sweep_at = _MANY
        self.next_s = inf  # nothing is due before; a cancelled call may still count here

    def add(self, call: ScheduledCall) -> None:
        """Put a call in its place."""
        self._insert(call)
        self.next_s = min(self.next_s, call.due_s)

    def next_due_s(self) -> float:
        """Return when the next call is due; infinity when there is none."""
        entries = self._entries
        while entries and entries[-1][2].cancelled:
            entries.pop()
        self.next_s = -entries[-1][0] if entries else inf
        return self.next_s

    def take(self) -> ScheduledCall:
        """Take the next call out, a cancelled one as well. Raises IndexError when there is none.

        ``next_s`` has regard to when a periodic one is due again, until it is put back.
        """
        entries = self._entries
        call = entries.pop()[2]
        self.next_s = call.due_s + call.period_s
        if entries and -entries[-1][0] < self.next_s:
            self.next_s = -entries[-1][0]
        return call

    def repeat(self, call: ScheduledCall) -> None:
        """Put a periodic call back for its next multiple of the period that is still to come.

        A late call does not shift the next one; periods missed altogether are skipped.
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
        entry = (-call.due_s, next(self._places), call)
        if not entries or entries[-1] < entry:
            entries.append(entry)
        else:
            insort(entries, entry)

    def _sweep(self) -> None:
        self._entries[:] = [entry for entry in self._entries if not entry[2].cancelled]
        self._sweep_at = max(_MANY, 2 * len(self._entries))
