"""Calls at a time: a heap on the steady clock."""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable
from time import monotonic

_MANY = 64  # cancelled calls that may linger in the heap before it is swept


class ScheduledCall:
    """A call that is due at ``due_s``, and each ``period_s`` after that where there is one."""

    __slots__ = ("callback", "cancelled", "due_s", "period_s")

    def __init__(
        self, due_s: float, period_s: float | None, callback: Callable[[], object]
    ) -> None:
        """Raise ValueError for a period that is not positive and a time that is no number."""
        if period_s is not None and not period_s > 0:
            raise ValueError(f"a period must be positive, not {period_s:g} s")
        if math.isnan(due_s):
            raise ValueError("a delay must be a number")
        self.due_s = due_s
        self.period_s = period_s
        self.callback = callback
        self.cancelled = False

    @property
    def late_s(self) -> float:
        """How long ago the call was due, in seconds."""
        return monotonic() - self.due_s

    def cancel(self) -> None:
        """Never call again."""
        self.cancelled = True


class TimerHeap:
    """Scheduled calls, the next one first. To be used by one thread."""

    def __init__(self) -> None:
        self._heap: list[tuple[float, int, ScheduledCall]] = []
        self._order = itertools.count()  # calls due at the same time keep their order
        self._sweep_at = _MANY
        self.next_s = math.inf  # nothing is due before; a cancelled call may still count here

    def add(self, call: ScheduledCall) -> None:
        """Put a call in its place."""
        if len(self._heap) >= self._sweep_at:
            self._sweep()
        heapq.heappush(self._heap, (call.due_s, next(self._order), call))
        self.next_s = self._heap[0][0]

    def next_due_s(self) -> float | None:
        """Return when the next call is due, or None when there is none."""
        heap = self._heap
        while heap and heap[0][2].cancelled:
            heapq.heappop(heap)
        self.next_s = heap[0][0] if heap else math.inf
        return heap[0][0] if heap else None

    def take_due(self) -> list[ScheduledCall]:
        """Take out every call that is due by now, in order."""
        now_s = monotonic()
        due = []
        while self._heap and self._heap[0][0] <= now_s:
            call = heapq.heappop(self._heap)[2]
            if not call.cancelled:
                due.append(call)
        self.next_s = self._heap[0][0] if self._heap else math.inf
        return due

    def repeat(self, call: ScheduledCall) -> None:
        """Put a periodic call back for its next multiple of the period that is still to come.

        A late call does not shift the next one; periods missed altogether are skipped.
        """
        if call.period_s is None or call.cancelled:
            return
        call.due_s += call.period_s
        late_s = call.late_s
        if late_s >= 0.0:
            call.due_s += (math.floor(late_s / call.period_s) + 1) * call.period_s
        self.add(call)

    def _sweep(self) -> None:
        self._heap = [entry for entry in self._heap if not entry[2].cancelled]
        heapq.heapify(self._heap)
        self._sweep_at = max(_MANY, 2 * len(self._heap))
