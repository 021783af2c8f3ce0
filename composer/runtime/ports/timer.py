"""The timers of a node."""

from __future__ import annotations

import math
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

from composer.expressions import EvaluationError, Expression
from composer.model import Period, TimerClock
from composer.model import Timer as TimerModel
from composer.runtime.core import Core
from composer.runtime.line import line_for
from composer.runtime.loop import Timer
from composer.runtime.reactions import RunningReaction
from composer.runtime.tracing import CallbackTimer


class PeriodError(Exception):
    """A period that no timer can have."""


def period_s(period: Period, parameters: Mapping[str, Any]) -> float:
    """Return the period in seconds with the given parameter values. Raises PeriodError."""
    value: Any = period.value
    try:
        if isinstance(value, Expression):
            value = value.evaluate({"parameters": parameters})
        seconds = period.seconds(float(value))
    except (EvaluationError, ZeroDivisionError, TypeError, ValueError) as error:
        raise PeriodError(f"{period.unit} cannot be {value}: {error}") from error
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise PeriodError(f"{period.unit} is {value}, but must be above zero")
    return seconds


class TimerPort:
    """Calls the timer's reaction and handler while the node is active.

    A call that is due while the one before is not through is left out and counted, unless the
    timer is reentrant.
    """

    def __init__(
        self,
        core: Core,
        timer: TimerModel,
        reaction: RunningReaction | None,
        handler: Callable[[], Any] | None,
    ) -> None:
        """Make it, standing still. Raises PeriodError."""
        self._core = core
        self._name = timer.name.value
        self._callback = f"on_{self._name}"
        self._clock = core.loop if timer.clock is TimerClock.STEADY else core.clock
        self._period = timer.period
        self._period_s = period_s(timer.period, core.names["parameters"])
        self._reaction = reaction
        self._handler = handler
        self._traced = core.statistics.callback("timer", self._name)
        self._line = line_for(
            core,
            self._work,
            CallbackTimer(core, self._traced, timer.budget_ms),
            depth=0,
            reentrant=timer.reentrant,
        )
        self._timer: Timer | None = None

    def follow_parameters(self) -> None:
        """Take over the period that the parameters say now. Raises PeriodError."""
        seconds = period_s(self._period, self._core.names["parameters"])
        if seconds != self._period_s:
            self._period_s = seconds
            self._begin_anew()

    def follow_clock(self) -> None:
        """Take over that the node's time has become another."""
        if self._clock is self._core.clock:
            self._begin_anew()

    def activate(self) -> None:
        """Start; the first call comes one period from now."""
        if self._timer is None:
            self._timer = self._clock.call_every(self._period_s, self._tick)

    def deactivate(self) -> None:
        """Stand still."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def destroy(self) -> None:
        """End for good."""
        self.deactivate()

    def _begin_anew(self) -> None:
        if self._timer is not None:
            self.deactivate()
            self.activate()

    def _tick(self) -> None:
        if not self._core.gate.incoming:
            return
        if self._timer is not None and self._core.statistics.tracing:
            self._traced.lateness.take(self._timer.late_s)
        if self._line.put(True) is not None:
            self._core.statistics.skipped += 1
            self._traced.dropped += 1

    def _work(self, _: bool) -> Coroutine[Any, Any, None] | None:
        if self._reaction is not None:
            try:
                self._reaction.run()
            except Exception as error:
                self._core.faults.take(f"timer '{self._name}'", error)
        if self._handler is None:
            return None
        return self._core.call(self._callback, self._handler)
