"""Timers and guard conditions that a class creates."""

from __future__ import annotations

from functools import partial
from typing import Any

from rclpy.clock_type import ClockType
from rclpy.guard_condition import GuardCondition
from rclpy.node import Node
from rclpy.timer import Rate, Timer

from composer.base.source import Located
from composer.model import Period, PeriodUnit, TimerClock
from composer.model import Timer as TimerModel
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.tasks import name_of
from composer.runtime.executors.tracebacks import calls_user_code
from composer.runtime.hosting.instance import Instance, is_reentrant
from composer.runtime.hosting.user_code import call_in_group
from composer.runtime.ports.timer import TimerPort

_NANOSECONDS = 1e9
#: rclpy accepts a period of zero, which calls as often as possible.
_SHORTEST_MS = 0.001


class HostedTimer(Timer):
    """The timer that the class uses: rclpy's, whose class is replaced by this one.

    rcl keeps the times that the class can ask for; the port calls. A timer that was canceled stays
    canceled when the node is activated.
    """

    _port: HostedTimerPort
    _is_canceled: bool

    @property
    def timer_period_ns(self) -> int:
        """The period in nanoseconds; a new one counts from now."""
        return int(super().timer_period_ns)

    @timer_period_ns.setter
    def timer_period_ns(self, value: int) -> None:
        Timer.timer_period_ns.fset(self, value)  # type: ignore[attr-defined]
        self._port.set_period(int(value) / _NANOSECONDS)

    def is_canceled(self) -> bool:
        """Return whether the class has canceled it."""
        return self._is_canceled

    def cancel(self) -> None:
        """Stop it until :meth:`reset`."""
        self._is_canceled = True
        super().cancel()
        self._port.follow()

    def reset(self) -> None:
        """Start it, or start its period again."""
        self._is_canceled = False
        super().reset()
        self._port.restart()

    def destroy(self) -> None:
        """Destroy the timer."""
        self._is_canceled = True
        self._port.follow()
        super().destroy()


class HostedTimerPort(TimerPort):
    """Calls the callback of a timer while the node is active and the timer is not canceled.

    The timer of a rate runs in every state, since it wakes those who sleep at the rate.
    """

    def __init__(self, instance: Instance, timer: Any) -> None:
        self._instance = instance
        self._timer = timer
        self._is_rate = timer.callback_group is instance.node._rate_group
        self._is_active = self._is_rate
        is_canceled = Timer.is_canceled(timer)  # created without autostart
        timer.__class__ = HostedTimer
        timer._port, timer._is_canceled = self, is_canceled
        context = instance.context_for(timer.callback_group)
        name = "" if timer.callback is None else name_of(timer.callback).rpartition(".")[2]
        call_back: Any = partial(self._call_back)
        call_back.__name__ = name or "rate"  # of its counters, and of what faults of a test act on
        self._function = instance.function(call_back, timer, context)
        super().__init__(context, self._model(context), None, self._function)
        if name:
            self._name = name
        if self._is_rate:
            self.follow()

    def activate(self) -> None:
        """Start the timer unless the class has canceled it."""
        self._is_active = True
        self.follow()

    def deactivate(self) -> None:
        """Stop the timer."""
        self._is_active = self._is_rate
        self.follow()

    def destroy(self) -> None:
        """Stop and destroy the timer."""
        self._is_active = False
        self.follow()
        if self._is_rate:
            self._tick()
        self._instance.timer_names.discard(self._statistics.name)
        Node.destroy_timer(self._instance.node, self._timer)

    def follow(self) -> None:
        """Run or stop, as the class wants it and the state of the node allows."""
        if self._is_active and not self._timer.is_canceled():
            if self._scheduled is None:
                Timer.reset(self._timer)  # its period starts now
            super().activate()
        else:
            super().deactivate()

    def restart(self) -> None:
        """Start the period again."""
        super().deactivate()
        self.follow()

    def set_period(self, seconds: float) -> None:
        """Change the period."""
        self._period_s = seconds
        self.restart()

    def _restart(self) -> None:
        self.restart()

    def _tick(self) -> None:
        if not self._is_rate:
            super()._tick()
        elif self._timer.callback is not None:
            self._timer.callback()

    @calls_user_code
    def _call_back(self) -> Any:
        if not self._context.gate.incoming:
            return None  # it waited for its callback group meanwhile
        timer = self._timer
        with timer.handle:
            timer.handle.call_timer()  # so that the class sees when the next call is due
        # Read each time: a rate sets the callback of its timer after creating it.
        return None if timer.callback is None else timer.callback()

    def _model(self, context: NodeContext) -> TimerModel:
        timer, instance = self._timer, self._instance
        span = instance.ports.node.span
        is_ros = timer.clock.clock_type == ClockType.ROS_TIME
        milliseconds = Timer.timer_period_ns.fget(timer) / 1e6  # type: ignore[attr-defined]
        return TimerModel(
            Located(instance.timer_name(timer.callback), span),
            Period(max(milliseconds, _SHORTEST_MS), PeriodUnit.MILLISECONDS, span),
            span,
            clock=TimerClock.ROS if is_ros else TimerClock.STEADY,
            reentrant=is_reentrant(context),
        )


class HostedRate(Rate):
    """The rate that the class uses: rclpy's, whose class is replaced by this one."""

    _instance: Instance

    def sleep(self) -> None:
        """Block until the next time. In a callback, the loop goes on."""
        self._presleep()
        try:
            self._instance.wait(self._event)
        finally:
            self._postsleep()


class HostedGuardCondition(GuardCondition):
    """The guard condition that the class uses: rclpy's, whose class is replaced by this one."""

    _instance: Instance

    def trigger(self) -> None:
        """Call the callback soon, if the node is active then."""
        if self.callback is not None:
            context = self._instance.context_for(self.callback_group)
            function = self._instance.function(self.callback, self, context)
            context.loop.call_soon(partial(call_in_group, context, function))
