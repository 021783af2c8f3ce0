"""The timers of a node."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from typing import TYPE_CHECKING, Any

from composer.model import Timer, TimerClock
from composer.runtime.callbacks.callback import EMPTY, Callback, mutation_checked
from composer.runtime.callbacks.user_code import queue_for
from composer.runtime.executors.base_loop import ScheduledCall
from composer.runtime.ports import RunningPort

if TYPE_CHECKING:
    from composer.runtime.callbacks.context import NodeContext
    from composer.runtime.callbacks.reactions import RunningReaction


class TimerPort(Callback, RunningPort):
    """Calls the timer's reaction and handler while the node is active.

    A call that is due while the previous one is running is skipped and counted, unless the timer is
    reentrant.
    """

    def __init__(
        self,
        context: NodeContext,
        timer: Timer,
        reaction: RunningReaction | None,
        handler: Callable[[], Any] | None,
    ) -> None:
        """Create the timer, stopped. Raises PeriodError."""
        name = timer.name.value
        self._clock = context.loop if timer.clock is TimerClock.STEADY else context.clock
        self._period = timer.period
        self._period_s = timer.period.seconds(context.names["parameters"])
        self._reaction = reaction
        self._handler = handler
        statistics = context.statistics.callback("timer", name)
        self._lateness = statistics.lateness if context.statistics.tracing else None
        react = mutation_checked(context.mutations, statistics, self._react)
        handle: Callable[[], Any] = partial(react, EMPTY)
        if handler and not (reaction or context.mutations):
            handle = handler  # without a frame in between
        super().__init__(context, f"on_{name}", handle, statistics, timer.budget_ms)
        self._queue = queue_for(context, self._call, None, depth=0, reentrant=timer.reentrant)
        self._scheduled: ScheduledCall | None = None
        self._on_time = self._tick
        if context.instruments is not None:
            self._on_time = context.instruments.timer(context.names["node"], name, self._tick)

    def follow_parameters(self) -> None:
        """Apply the period that the parameters have now. Raises PeriodError."""
        seconds = self._period.seconds(self._context.names["parameters"])
        if seconds != self._period_s:
            self._period_s = seconds
            self._restart()

    def follow_clock(self) -> None:
        """Follow the node's switch to or from simulated time."""
        if self._clock is self._context.clock:
            self._restart()

    def activate(self) -> None:
        """Start the timer; the first call is one period from now."""
        if self._scheduled is None:
            self._scheduled = self._clock.call_every(self._period_s, self._on_time)

    def deactivate(self) -> None:
        """Stop the timer."""
        if self._scheduled is not None:
            self._scheduled.cancel()
            self._scheduled = None

    def destroy(self) -> None:
        """Stop the timer."""
        self.deactivate()

    def _restart(self) -> None:
        if self._scheduled is not None:
            self.deactivate()
            self.activate()

    def _tick(self) -> None:
        if not self._context.gate.incoming:
            return
        if self._lateness is not None and self._scheduled is not None:
            self._lateness.add(self._scheduled.late_s)
        if self._queue.put(EMPTY) is not None:
            self._context.statistics.skipped += 1
            self._statistics.dropped += 1

    def _react(self, _: object) -> Coroutine[Any, Any, None] | None:
        if self._reaction is not None:
            try:
                self._reaction.run()
            except Exception as error:
                self._context.error_log.exception(str(self._statistics), error)
        return None if self._handler is None else self._context.call(self._name, self._handler)
