"""The loop of a behavior in a test, in virtual time, and what its ports share."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import field
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.behavior import Logger
from composer.runtime.callbacks.user_code import CallbackQueue, Faults, UserCode, queue_for
from composer.runtime.clock import VirtualClock
from composer.runtime.executors.base_loop import BaseLoop, ScheduledCall, TimerQueue
from composer.runtime.executors.futures import Future
from composer.runtime.executors.strand import InlineStrand
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate
from composer.runtime.metrics.statistics import Statistics
from composer.testing.failures import TestFailure

#: More calls than any test makes at one point in time.
_CALLS_AT_ONE_TIME = 20_000
#: Times that differ by less are equal: sums of periods are not exact.
_SAME_TIME_S = 1e-9


class VirtualLoop(BaseLoop):
    """Makes all calls in one order: by time, and at one time in the order of their requests."""

    is_simulated = False  # by /clock

    def __init__(
        self, clock: VirtualClock, on_exception: Callable[[str, BaseException], None]
    ) -> None:
        self._ready: deque[Callable[[], object]] = deque()
        self._timers = TimerQueue[ScheduledCall](clock.monotonic, has_ticks=clock.has_ticks)
        self._clock = clock
        #: Raised by :meth:`run_until` as soon as there is one.
        self.errors: deque[BaseException] = deque()
        super().__init__("test", on_exception, clock)

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` after those that are ready."""
        self._ready.append(callback)

    def busy_threads(self) -> tuple[int, ...]:
        """Return nothing: the only thread is the test's."""
        return ()

    def is_current(self) -> bool:
        """Return true: the only thread is the test's."""
        return True

    def _schedule(self, call: ScheduledCall) -> ScheduledCall:
        self._timers.add(call)
        return call

    def run_until(self, is_over: Callable[[], object], until_s: float) -> bool:
        """Make calls until ``is_over()``; return false if that is not so at ``until_s``.

        Raises the first of ``errors``, and what ``is_over`` raises.
        """
        calls = 0
        while not is_over():
            calls += 1
            if calls > _CALLS_AT_ONE_TIME:
                at_s = self.clock.monotonic()
                raise TestFailure(f"{calls - 1:,} calls at {at_s:g} s: no time passes")
            if self._ready:
                self._ready.popleft()()
                self.raise_error()
                continue
            next_s = self._timers.next_due_s()
            is_due = next_s <= until_s + _SAME_TIME_S
            due_s = next_s if is_due else until_s
            if due_s > self.clock.monotonic():
                self._clock.wait_until(lambda: False, due_s)
                calls = 0
            if not is_due:
                return False
            call = self._timers.pop()
            try:
                if not call.cancelled:
                    call.callback()
            finally:
                self._timers.reschedule(call)
            self.raise_error()
        return True

    def raise_error(self) -> None:
        """Raise the first of ``errors``, if any."""
        if self.errors:
            raise self.errors.popleft()


@dataclass(slots=True)
class TestContext(UserCode):
    """What the ports of a behavior share; the counterpart of the runtime's ``NodeContext``.

    ``clock`` is what sleeps wait for. ``record(port, message)`` keeps what the behavior sends,
    ``note`` adds a line to the timeline.
    """

    __test__ = False

    loop: VirtualLoop
    clock: VirtualLoop
    gate: LifecycleGate
    log: Logger
    error_log: Faults
    record: Callable[[str, Any], None]
    note: Callable[[str], None]
    names: dict[str, Any]
    time_type: Any
    router: None = None
    statistics: Statistics = field(default_factory=Statistics)
    mutations: None = None
    instruments: None = None
    strand: InlineStrand = field(default_factory=InlineStrand)
    tasks: set[Future[Any]] = field(default_factory=set)

    def now_s(self) -> float:
        """Return the time of the node in seconds since 1970."""
        return self.loop.clock.time()

    def stamp(self) -> Any:
        """Return the time of the node as a builtin_interfaces/msg/Time."""
        seconds, nanoseconds = divmod(self.loop.clock.time_ns(), 1_000_000_000)
        return self.time_type(sec=seconds, nanosec=nanoseconds)

    def queue(
        self, work: Callable[[Any], Any], *, depth: int | None = None, reentrant: bool = False
    ) -> CallbackQueue[Any]:
        """Return a queue that works on one item at a time."""
        return queue_for(self, work, None, depth=depth, reentrant=reentrant)
