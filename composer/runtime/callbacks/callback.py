"""Calls handlers of user code: their faults stay contained, and their time is counted.

The time counted is that during which a callback keeps its thread; an ``async`` callback does not
keep it while it awaits.

Timing is always on, so it must be cheap. Reading the clock twice takes a tenth of a microsecond,
too much for a hundred thousand calls per second. Of callbacks with more than :data:`HOT_HZ` calls
per second, every sixteenth call is timed and counts sixteen times. A callback with a ``budget_ms``
is timed at every call.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from math import inf
from typing import TYPE_CHECKING, Any, Final, TypeVar
from weakref import ref

from composer.base.source import Located
from composer.runtime.executors.strand import Work, in_steps
from composer.runtime.executors.tracebacks import calls_user_code
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.metrics.statistics import BATCH_SIZE, CallbackStatistics

if TYPE_CHECKING:
    from composer.runtime.callbacks.context import NodeContext
    from composer.runtime.callbacks.observers import MutationCheck

T = TypeVar("T")

#: Up to this rate, every call is timed.
HOT_HZ = 1000.0
_HOT_WEIGHT = 16
#: Minimum time between two warnings about the same callback.
WARNING_PERIOD_S = 5.0
_LAST = BATCH_SIZE - 1  # the call that completes a batch
#: The message for a handler without an argument.
EMPTY: Final = object()


class CallbackTimer:
    """Times the calls of one callback and checks its budget.

    ``to_skip`` is the number of the next calls that need not be timed. The caller decrements it for
    each call that it does not time. ``last_s`` is when the last timed call began.
    """

    __slots__ = (
        "__weakref__",
        "_adapted_s",
        "_batch",
        "_budget_s",
        "_log",
        "_monotonic",
        "_mutations",
        "_repeats",
        "_skip",
        "_statistics",
        "_times",
        "last_s",
        "to_skip",
    )

    def __init__(
        self,
        context: NodeContext,
        statistics: CallbackStatistics,
        budget_ms: Located[float] | None,
    ) -> None:
        self._monotonic = context.loop.clock.monotonic
        self._statistics = statistics
        statistics.timer = ref(self)
        self._mutations = context.mutations
        self.last_s = 0.0
        self._log = context.log
        self._budget_s, self._repeats = inf, None
        if budget_ms is not None:
            self._budget_s = budget_ms.value / 1e3
            self._repeats = RepeatLimit(context.loop.clock, WARNING_PERIOD_S)
        self._times = statistics.times
        self._batch = statistics.times.batch
        self._adapted_s = 0.0
        is_on = context.statistics.tracing or budget_ms is not None
        self._skip = self.to_skip = 0.0 if is_on else inf

    def call(self, work: Work[T], item: T) -> Coroutine[Any, Any, None] | None:
        """Do the work, timed."""
        began_s = self._monotonic()
        return self.finish(began_s, work(item))

    def finish(
        self, began_s: float, continuation: Coroutine[Any, Any, None] | None
    ) -> Coroutine[Any, Any, None] | None:
        """Count a call that began at ``began_s`` of the clock and releases its thread now.

        Returns ``continuation``, the rest of an ``async`` call, timed.
        """
        duration_s = self._monotonic() - began_s
        self.last_s = began_s
        if continuation is not None:
            self._time_every(1)
            return self._timed_steps(continuation, duration_s)
        batch = self._batch
        batch.append(duration_s)
        if len(batch) >= BATCH_SIZE:
            self._adapt(began_s)
        self.to_skip = self._skip
        if duration_s > self._budget_s:
            self._on_overrun(duration_s)
        return None

    def wrap(self, work: Work[T]) -> Work[T]:
        """Return ``work``, timed."""
        work = mutation_checked(self._mutations, self._statistics, work)

        def timed(item: T) -> Coroutine[Any, Any, None] | None:
            if self.to_skip > 0:  # two threads may both decrement the last one
                self.to_skip -= 1
                return work(item)
            return self.call(work, item)

        return timed

    def wrap_steps(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return ``coroutine`` with its steps timed, as one call."""
        if self._mutations is not None:
            coroutine = self._mutations.wrap_steps(str(self._statistics), coroutine)
        return coroutine if self.to_skip == inf else self._timed_steps(coroutine, 0.0)

    def _timed_steps(
        self, coroutine: Coroutine[Any, Any, T], duration_s: float
    ) -> Coroutine[Any, Any, T]:
        stopwatch = _Stopwatch(duration_s, self._monotonic)

        def on_end() -> None:
            self._times.add(stopwatch.total_s)
            if stopwatch.total_s > self._budget_s:
                self._on_overrun(stopwatch.total_s)

        return in_steps(stopwatch, coroutine, on_end)

    def _on_overrun(self, duration_s: float) -> None:
        """Count a call that exceeds the budget, and warn unless there was a warning just before."""
        callback = self._statistics
        callback.overruns += 1
        if self._repeats is None or self._repeats.admit(str(callback)) is None:
            return
        self._log.warn(
            f"{callback} took {duration_s * 1e3:.1f} ms, over its budget of "
            f"{self._budget_s * 1e3:g} ms ({callback.overruns} times so far, at most "
            f"{callback.times.longest_s * 1e3:.1f} ms)"
        )

    def _adapt(self, now_s: float) -> None:
        """Flush the batch, and choose how many calls are timed by how frequent they are."""
        self._times.flush()
        if self._budget_s == inf:
            calls = BATCH_SIZE * (self._skip + 1)
            is_hot = calls > HOT_HZ * (now_s - self._adapted_s)
            self._adapted_s = now_s
            self._time_every(_HOT_WEIGHT if is_hot else 1)

    def _time_every(self, weight: int) -> None:
        """Time one of ``weight`` calls, and count it ``weight`` times."""
        self._skip = weight - 1.0
        self._times.set_weight(weight)


def mutation_checked(
    mutations: MutationCheck | None, statistics: CallbackStatistics, work: Work[T]
) -> Work[T]:
    """Return ``work``, followed by a mutation check if that is enabled."""
    return work if mutations is None else mutations.wrap(str(statistics), work)


class _Stopwatch:
    """Adds up the steps of a coroutine."""

    __slots__ = ("_began_s", "_monotonic", "total_s")

    def __init__(self, total_s: float, monotonic: Callable[[], float]) -> None:
        self._monotonic = monotonic
        self.total_s = total_s
        self._began_s = 0.0

    def enter(self) -> None:
        """Begin a step, at once."""
        self._began_s = self._monotonic()

    def leave(self) -> None:
        """End a step."""
        self.total_s += self._monotonic() - self._began_s


class Callback(CallbackTimer):
    """Calls a handler and times it; its exceptions are faults of ``name``."""

    __slots__ = ("_context", "_handle", "_name")

    def __init__(
        self,
        context: NodeContext,
        name: str,
        handle: Callable[..., Any],
        statistics: CallbackStatistics,
        budget_ms: Located[float] | None,
    ) -> None:
        super().__init__(context, statistics, budget_ms)
        self._context = context
        self._name = name
        self._handle = handle

    @calls_user_code
    def _call(self, message: Any) -> Coroutine[Any, Any, None] | None:
        """Handle ``message``; return the rest of the call if it is ``async``."""
        began_s = 0.0
        if self.to_skip > 0.0:  # two threads may both decrement the last one
            self.to_skip -= 1
        else:
            began_s = self._monotonic()
        try:
            result = self._handle() if message is EMPTY else self._handle(message)
            rest = None if result is None else self._context.continuation(self._name, result)
        except BaseException as error:
            self._context.error_log.exception(self._name, error)
            rest = None
        if not began_s:
            return rest
        duration_s = self._monotonic() - began_s
        batch = self._batch
        if rest is not None or duration_s > self._budget_s or len(batch) >= _LAST:
            return self.finish(began_s, rest)
        batch.append(duration_s)  # as in finish, without a call
        self.last_s = began_s
        self.to_skip = self._skip
        return None
