"""The timers of a node."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from composer.model import Timer as TimerModel
from composer.model import TimerClock
from composer.runtime.callbacks.callback import NOTHING, Callback
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.queue import line_for
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.callbacks.timing import watched
from composer.runtime.executors.loop import Timer


class TimerPort(Callback):
    """Calls the timer's reaction and handler while the node is active.

    A call that is due while the one before is not through is left out and counted, unless the
    timer is reentrant.
    """

    def __init__(
        self,
        core: NodeContext,
        timer: TimerModel,
        reaction: RunningReaction | None,
        handler: Callable[[], Any] | None,
    ) -> None:
        """Make it, standing still. Raises PeriodError."""
        name = timer.name.value
        self._clock = core.loop if timer.clock is TimerClock.STEADY else core.clock
        self._period = timer.period
        self._period_s = timer.period.seconds(core.names["parameters"])
        self._reaction = reaction
        self._handler = handler
        self._traced = core.statistics.callback("timer", name)
        self._lateness = self._traced.lateness if core.statistics.tracing else None
        react = watched(core.mutations, self._traced, self._react)
        handle: Callable[[], Any] = partial(react, NOTHING)
        if handler and not (reaction or core.mutations):
            handle = handler  # which is shorter
        super().__init__(core, f"on_{name}", handle, self._traced, timer.budget_ms)
        self._line = line_for(core, self._call, None, depth=0, reentrant=timer.reentrant)
        self._scheduled: Timer | None = None

    def follow_parameters(self) -> None:
        """Take over the period that the parameters say now. Raises PeriodError."""
        seconds = self._period.seconds(self._core.names["parameters"])
        if seconds != self._period_s:
            self._period_s = seconds
            self._begin_anew()

    def follow_clock(self) -> None:
        """Take over that the node's time has become another."""
        if self._clock is self._core.clock:
            self._begin_anew()

    def activate(self) -> None:
        """Start; the first call comes one period from now."""
        if self._scheduled is None:
            self._scheduled = self._clock.call_every(self._period_s, self._tick)

    def deactivate(self) -> None:
        """Stand still."""
        if self._scheduled is not None:
            self._scheduled.cancel()
            self._scheduled = None

    def destroy(self) -> None:
        """End for good."""
        self.deactivate()

    def _begin_anew(self) -> None:
        if self._scheduled is not None:
            self.deactivate()
            self.activate()

    def _tick(self) -> None:
        if not self._core.gate.incoming:
            return
        if self._lateness is not None and self._scheduled is not None:
            self._lateness.take(self._scheduled.late_s)
        if self._line.put(NOTHING) is not None:
            self._core.statistics.skipped += 1
            self._traced.dropped += 1

    def _react(self, _: object) -> Coroutine[Any, Any, None] | None:
        if self._reaction is not None:
            try:
                self._reaction.run()
            except Exception as error:
                self._core.error_log.exception(str(self._traced), error)
        return None if self._handler is None else self._core.call(self._name, self._handler)
