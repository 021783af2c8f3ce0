"""How long callbacks take.

What is counted is the time for which a callback keeps its thread; while an ``async`` one waits it
does not.

This is always on and so has to cost little, which two looks at the clock, a tenth of a microsecond,
are not for who is called a hundred thousand times a second: of callbacks that come more often than
:data:`HOT_HZ` each sixteenth call stands for sixteen. One with a ``budget_ms`` is timed at every
call.
"""

from __future__ import annotations

from collections.abc import Coroutine
from math import inf
from time import monotonic
from typing import Any, TypeVar

from composer.runtime.callbacks.budget import Budget
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.mutation_check import MutationCheck
from composer.runtime.executors.strand import Work, in_steps
from composer.runtime.metrics.histogram import TOGETHER
from composer.runtime.metrics.statistics import CallbackStatistics
from composer.source import Located

T = TypeVar("T")

#: Up to so many calls a second, every one of them is timed.
HOT_HZ = 1000.0
_STANDS_FOR = 16


class CallbackTimer:
    """Takes the times of one callback, and names it when it takes longer than it may.

    ``pause`` is how many of the calls to come need not be timed: whoever makes one that is not
    counts it down.
    """

    __slots__ = (
        "_budget",
        "_budget_s",
        "_looked_s",
        "_mutations",
        "_pause",
        "_statistics",
        "_times",
        "_waiting",
        "pause",
    )

    def __init__(
        self, core: NodeContext, statistics: CallbackStatistics, budget_ms: Located[float] | None
    ) -> None:
        self._statistics = statistics
        self._mutations = core.mutations
        self._budget_s = inf if budget_ms is None else budget_ms.value / 1e3
        self._budget = Budget(core.log, statistics, self._budget_s)
        self._times = statistics.times
        self._waiting = statistics.times.waiting
        self._looked_s = 0.0
        is_on = core.statistics.tracing or budget_ms is not None
        self._pause = self.pause = 0.0 if is_on else inf

    def call(self, work: Work[T], item: T) -> Coroutine[Any, Any, None] | None:
        """Do the work, timed."""
        began_s = monotonic()
        return self.took(began_s, work(item))

    def took(
        self, began_s: float, rest: Coroutine[Any, Any, None] | None
    ) -> Coroutine[Any, Any, None] | None:
        """Count what began at ``began_s`` of ``monotonic()`` and keeps the thread no longer.

        Returns ``rest``, timed: what is left of it where it is ``async``.
        """
        took_s = monotonic() - began_s
        if rest is not None:
            self._time_each(1)
            return self._to_its_end(rest, took_s)
        waiting = self._waiting
        waiting.append(took_s)
        if len(waiting) >= TOGETHER:
            self._look(began_s)
        self.pause = self._pause
        if took_s > self._budget_s:
            self._budget.take(took_s)
        return None

    def around(self, work: Work[T]) -> Work[T]:
        """Return ``work``, timed."""
        work = watched(self._mutations, self._statistics, work)

        def timed(item: T) -> Coroutine[Any, Any, None] | None:
            if self.pause > 0:  # two threads may both count down the last
                self.pause -= 1
                return work(item)
            return self.call(work, item)

        return timed

    def steps(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return ``coroutine``, the steps of which are timed and count as one call."""
        if self._mutations is not None:
            coroutine = self._mutations.steps(str(self._statistics), coroutine)
        return coroutine if self.pause == inf else self._to_its_end(coroutine, 0.0)

    async def _to_its_end(self, coroutine: Coroutine[Any, Any, T], took_s: float) -> T:
        stopwatch = _Stopwatch(took_s)
        try:
            return await in_steps(stopwatch, coroutine)
        finally:
            self._times.take(stopwatch.took_s)
            if stopwatch.took_s > self._budget_s:
                self._budget.take(stopwatch.took_s)

    def _look(self, now_s: float) -> None:
        """Put what waits into the histogram, and see how often the callback is called."""
        self._times.settle()
        if self._budget_s == inf:
            calls = TOGETHER * (self._pause + 1)
            is_hot = calls > HOT_HZ * (now_s - self._looked_s)
            self._looked_s = now_s
            self._time_each(_STANDS_FOR if is_hot else 1)

    def _time_each(self, how_many: int) -> None:
        """Time one of so many calls, for all of them."""
        self._pause = how_many - 1.0
        self._times.stand_for(how_many)


def watched(
    mutations: MutationCheck | None, statistics: CallbackStatistics, work: Work[T]
) -> Work[T]:
    """Return ``work``, after which messages are looked at where that is asked for."""
    return work if mutations is None else mutations.around(str(statistics), work)


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
