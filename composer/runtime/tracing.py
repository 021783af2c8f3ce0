"""How long callbacks take.

What is counted is the time for which a callback keeps its thread; while an ``async`` one waits it
does not.

This is always on and so has to cost little, which two looks at the clock and one bucket of a
histogram, a quarter of a microsecond, are not for who is called a hundred thousand times a second:
of callbacks that come more often than :data:`HOT_HZ` each sixteenth call stands for sixteen. One
with a ``budget_ms`` is timed at every call.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Coroutine
from math import inf
from time import monotonic
from typing import Any, TypeVar

from composer.runtime.budget import Budget
from composer.runtime.core import Core
from composer.runtime.durations import BOUNDS_S
from composer.runtime.line import Work
from composer.runtime.statistics import CallbackStatistics
from composer.runtime.strand import in_steps
from composer.source import Located

T = TypeVar("T")

#: Up to so many calls a second, every one of them is timed.
HOT_HZ = 1000.0
_STANDS_FOR = 16


class CallbackTimer:
    """Takes the times of one callback, and names it when it takes longer than it may."""

    def __init__(
        self, core: Core, statistics: CallbackStatistics, budget_ms: Located[float] | None
    ) -> None:
        self._statistics = statistics
        self._mutations = core.mutations
        self._is_on = core.statistics.tracing or budget_ms is not None
        self._budget_s = inf if budget_ms is None else budget_ms.value / 1e3
        self._budget = Budget(core.log, statistics, self._budget_s)

    def around(self, work: Work[T]) -> Work[T]:
        """Return ``work``, timed. It must not raise."""
        if self._mutations is not None:
            work = self._mutations.around(str(self._statistics), work)
        if not self._is_on:
            return work
        times, buckets = self._statistics.times, self._statistics.times.buckets
        budget_s, budget = self._budget_s, self._budget
        hot_s = _STANDS_FOR / HOT_HZ if budget_s == inf else 0.0  # too soon for so many calls
        untimed = 0  # so many calls to come
        weight = 1  # so many calls the next one that is timed stands for
        until_look = 0  # so many timed calls before it is seen how often they come
        looked_s = 0.0

        def timed(item: T) -> Coroutine[Any, Any, None] | None:
            nonlocal untimed, weight, until_look, looked_s
            if untimed:
                untimed -= 1
                return work(item)
            began_s = monotonic()
            rest = work(item)
            took_s = monotonic() - began_s
            if rest is not None:
                return self._to_its_end(rest, took_s)
            # As in Durations.take and _end, but without a call.
            buckets[bisect(BOUNDS_S, took_s)] += weight
            times.total_s += took_s * weight
            if until_look:
                until_look -= 1
            else:
                is_hot = began_s - looked_s < hot_s
                untimed, until_look = (_STANDS_FOR - 1, 0) if is_hot else (0, _STANDS_FOR - 1)
                weight, looked_s = untimed + 1, began_s
            if took_s > times.longest_s:  # noqa: PLR1730  calling max takes as long as the rest
                times.longest_s = took_s
            if took_s > budget_s:
                budget.take(took_s)
            return None

        return timed

    def steps(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return ``coroutine``, the steps of which are timed and count as one call."""
        if self._mutations is not None:
            coroutine = self._mutations.steps(str(self._statistics), coroutine)
        return self._to_its_end(coroutine, 0.0) if self._is_on else coroutine

    async def _to_its_end(self, coroutine: Coroutine[Any, Any, T], took_s: float) -> T:
        stopwatch = _Stopwatch(took_s)
        try:
            return await in_steps(stopwatch, coroutine)
        finally:
            self._end(stopwatch.took_s)

    def _end(self, took_s: float) -> None:
        self._statistics.times.take(took_s)
        if took_s > self._budget_s:
            self._budget.take(took_s)


class _Stopwatch:
    """Adds up the steps of a coroutine."""

    __slots__ = ("_began_s", "took_s")

    def __init__(self, took_s: float) -> None:
        self.took_s = took_s
        self._began_s = 0.0

    def enter(self) -> None:
        """Begin a step, at once."""
        self._began_s = monotonic()

    def leave(self) -> None:
        """End a step."""
        self.took_s += monotonic() - self._began_s
