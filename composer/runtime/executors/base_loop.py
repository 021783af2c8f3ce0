"""Tasks, timers, calls from other threads and error reports of a loop."""

from __future__ import annotations

import itertools
import threading
import traceback
from abc import ABC, abstractmethod
from bisect import insort
from collections.abc import Callable, Coroutine
from math import floor, inf, isnan
from threading import get_ident
from typing import Any, Generic, TypeVar

from composer.runtime.clock import Clock
from composer.runtime.executors.futures import Future, done_event
from composer.runtime.executors.tasks import Report, Task, name_of
from composer.runtime.executors.tracebacks import format_stacks

_SWEEP_SIZE = 64  # entries at which canceled calls are removed
T = TypeVar("T")
_WAITS: dict[int, _Wait] = {}  # by the identifiers of the threads that wait
#: After this time without a wait, a loop sleeps for :data:`YIELD_S`. Polling releases the
#: interpreter's lock and takes it back before a waiting thread is awake. That thread counts it as
#: a switch and does not request the lock: without the sleep it starves for seconds.
BUSY_S = 0.005
YIELD_S = 5e-5  # enough for another thread to wake up
PAUSE_AFTER_FAULT_S = 0.01  # a permanent fault must not fill the log within a second


class ScheduledCall:
    """A call that is due at ``due_s``, and each ``period_s`` seconds after that if it has one.

    ``monotonic()`` returns the time that it follows. Canceling it twice is harmless.
    """

    __slots__ = ("_monotonic", "callback", "cancelled", "due_s", "period_s")

    #: How many units of its times are a second.
    per_s = 1

    def __init__(
        self,
        monotonic: Callable[[], float],
        due_s: float,
        period_s: float | None,
        callback: Callable[[], object],
    ) -> None:
        """Raise ValueError for a period that is not positive and a time that is NaN."""
        if period_s is not None and not period_s > 0:
            raise ValueError(f"a period must be positive, not {period_s / self.per_s:g} s")
        if isnan(due_s):
            raise ValueError("a delay must be a number")
        self._monotonic = monotonic
        self.due_s = due_s
        self.period_s = inf if period_s is None else period_s
        self.callback = callback
        self.cancelled = False

    @property
    def late_s(self) -> float:
        """How long ago the call was due, in seconds. Valid during the call."""
        return (self._monotonic() - self.due_s) / self.per_s

    def cancel(self) -> None:
        """Never call again."""
        self.cancelled = True


C = TypeVar("C", bound=ScheduledCall)


class TimerQueue(Generic[C]):
    """Scheduled calls, for use by one thread.

    A sorted list with the next call last, not a heap: taking that call and, if there are few,
    inserting it again needs no search. A periodic call is inserted again each time.
    """

    def __init__(self, monotonic: Callable[[], float], *, has_ticks: bool = False) -> None:
        """``has_ticks`` is as for :class:`.Clock`."""
        self._monotonic = monotonic
        self._has_ticks = has_ticks
        self._entries: list[tuple[float, int, C]] = []  # ascending: -due_s, -order
        self._order = itertools.count(0, -1)  # calls due at the same time keep their order
        self._sweep_at = _SWEEP_SIZE
        self.next_s = inf  # no call is due before; the call may be canceled

    def add(self, call: C) -> None:
        """Add a call."""
        self._insert(call)
        self.next_s = min(self.next_s, -self._entries[-1][0])

    def next_due_s(self) -> float:
        """Return when the next call is due; infinity if there is none."""
        entries = self._entries
        while entries and entries[-1][2].cancelled:
            entries.pop()
        self.next_s = -entries[-1][0] if entries else inf
        return self.next_s

    def pop(self) -> C:
        """Remove and return the next call, even a canceled one. Raises IndexError if empty.

        Until :meth:`reschedule`, ``next_s`` includes the next time of a periodic call.
        """
        entries = self._entries
        call = entries.pop()[2]
        self.next_s = call.due_s + call.period_s
        if entries and -entries[-1][0] < self.next_s:
            self.next_s = -entries[-1][0]
        return call

    def reschedule(self, call: C) -> None:
        """Add a periodic call again for the next multiple of its period in the future.

        A late call does not shift the next one; missed periods are skipped.
        """
        period_s = call.period_s
        if period_s != inf and not call.cancelled:
            due_s = call.due_s + period_s
            late_s = self._monotonic() - due_s
            if late_s >= 0.0:
                due_s += (floor(late_s / period_s) + 1) * period_s
            call.due_s = due_s
            self._insert(call)
        entries = self._entries
        self.next_s = -entries[-1][0] if entries else inf

    def move(self, due: Callable[[C], float]) -> None:
        """Let each call be due at ``due(call)``, as after a jump of the time."""
        calls = [call for _, _, call in reversed(self._entries)]
        self._entries.clear()
        for call in calls:
            call.due_s = due(call)
            self._insert(call)

    def _insert(self, call: C) -> None:
        entries = self._entries
        if len(entries) >= self._sweep_at:
            self._sweep()
        due_s = self._tick(call.due_s) if self._has_ticks else call.due_s
        entry = (-due_s, next(self._order), call)
        if not entries or entries[-1] < entry:
            entries.append(entry)
        else:
            insort(entries, entry)

    def _tick(self, due_s: float) -> float:
        """Return a time in whole nanoseconds, which is not over if ``due_s`` is not."""
        now_s = self._monotonic()
        if due_s <= now_s:
            return due_s
        tick_s = round(due_s, 9)
        return tick_s if tick_s > now_s else round(now_s + 1e-9, 9)

    def _sweep(self) -> None:
        self._entries[:] = [entry for entry in self._entries if not entry[2].cancelled]
        self._sweep_at = max(_SWEEP_SIZE, 2 * len(self._entries))


class _Wait:
    """A wait of a thread in :meth:`BaseLoop.wait`, and the exception that has ended it."""

    __slots__ = ("event", "interrupted_by")

    def __init__(self, event: threading.Event) -> None:
        self.event = event
        self.interrupted_by: type[BaseException] | None = None


def end_wait(thread: int, kind: type[BaseException]) -> bool:
    """Raise ``kind`` in a thread that waits for a loop; return false if it does not wait."""
    wait = _WAITS.get(thread)
    if wait is None:
        return False
    wait.interrupted_by = kind
    wait.event.set()
    return True


class BaseLoop(ABC):
    """The part of a loop that does not depend on how it waits and on which threads it calls.

    Methods may be called from any thread.
    """

    def __init__(self, name: str, on_exception: Report, clock: Clock) -> None:
        #: The clock by which its calls are due.
        self.clock = clock
        self._name = name
        self._on_exception = on_exception
        self._tasks: set[Task[Any]] = set()
        self._waits: set[threading.Event] = set()
        #: Makes a step of a task.
        self._step_soon: Callable[[Callable[[], object]], None] = self.call_soon
        self._stopping = False
        self._stopped = False

    @property
    def name(self) -> str:
        """The name of the executor in YAML."""
        return self._name

    @abstractmethod
    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""

    @abstractmethod
    def busy_threads(self) -> tuple[int, ...]:
        """Return the identifiers of the threads that are in a callback now."""

    @abstractmethod
    def is_current(self) -> bool:
        """Return whether the calling thread belongs to the loop."""

    def overlap(self) -> None:  # noqa: B027 - most loops do not
        """Let other threads serve the loop while a callback runs, if it is parallel."""

    @abstractmethod
    def _schedule(self, call: ScheduledCall) -> ScheduledCall:
        """Make ``call`` when it is due; return it."""

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> ScheduledCall:
        """Call ``callback`` once, ``delay_s`` seconds from now."""
        # Never before now: all calls due at one time are made before anything else.
        monotonic = self.clock.monotonic
        due_s = monotonic() + max(delay_s, 0.0)
        return self._schedule(ScheduledCall(monotonic, due_s, None, callback))

    def call_every(self, period_s: float, callback: Callable[[], object]) -> ScheduledCall:
        """Call ``callback`` each ``period_s`` seconds; a late call does not shift the next.

        Raises ValueError for a period that is not positive.
        """
        monotonic = self.clock.monotonic
        return self._schedule(ScheduledCall(monotonic, monotonic() + period_s, period_s, callback))

    def run_task(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run a coroutine; return the future of its result.

        Canceling the future throws ``Cancelled`` into the coroutine where it awaits. An exception
        that is never retrieved from the future is reported.
        """
        task = Task(coroutine, self._step_soon, self.report, self._tasks.discard)
        self._tasks.add(task)
        future = task.start()
        if self._stopped:
            task.abandon()
        return future

    def run(self, function: Callable[[], T], timeout_s: float | None = None) -> T:
        """Call ``function`` on the loop and wait for it; on the loop itself, call it at once.

        Raises what ``function`` raises; TimeoutError with the loop's stack if it takes longer,
        after which it is not started; and RuntimeError if the loop has stopped.
        """
        if self.is_current():
            return function()
        result: Future[T] = Future()
        right_to_start = [True]  # popping is atomic: started or revoked, never both

        def call() -> None:
            if not _take(right_to_start):
                return
            try:
                result.set_result(function())
            except BaseException as error:
                result.set_exception(error)

        self.call_soon(call)
        if self._stopped and _take(right_to_start):
            raise RuntimeError(f"executor '{self._name}' has stopped")
        if not self.clock.wait(done_event(result), timeout_s):
            status = "was not started" if _take(right_to_start) else "is still running"
            stack = self.current_stack()
            at = f"; the loop is at:\n{stack}" if stack else ""
            raise TimeoutError(f"'{name_of(function)}' {status} after {timeout_s:g} s{at}")
        return result.result()

    def wait(self, event: threading.Event, timeout_s: float | None = None) -> None:
        """Block until ``event`` is set or the time is over. A loop that stops sets the event.

        Raises what :func:`end_wait` was given.
        """
        ident = get_ident()
        self._waits.add(event)
        _WAITS[ident] = wait = _Wait(event)
        try:
            if not self._stopping:
                self.clock.wait(event, timeout_s)
        finally:
            _WAITS.pop(ident, None)
            self._waits.discard(event)
        if wait.interrupted_by is not None:
            raise wait.interrupted_by

    def _end_waits(self) -> None:
        """Let all waits return; the loop is stopping."""
        for done in tuple(self._waits):
            done.set()

    def current_stack(self) -> str:
        """Return the Python stacks of the callbacks that run now; empty if none does."""
        return format_stacks(self.busy_threads())

    def report(self, what: str, error: BaseException) -> None:
        """Pass an exception to the exception handler."""
        try:
            self._on_exception(what, error)
        except BaseException:
            traceback.print_exc()  # the handler itself failed


def _take(right: list[bool]) -> bool:
    """Take a right, unless it is taken."""
    try:
        right.pop()
    except IndexError:
        return False
    return True
