"""A node's clock: the node's time, and calls scheduled by it.

In simulated time (parameter ``use_sim_time``) that is the time of /clock. Otherwise the time is
that of the system clock, and calls are scheduled by the steady clock, which nothing adjusts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, cast

from rclpy.clock import ROSClock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from rclpy.time_source import USE_SIM_TIME_NAME

from composer.runtime.clock.virtual import VirtualClock
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.tasks import TimerHandle
from composer.runtime.node_time.sim_time import UNKNOWN, SimTimers, SimTimeSource


class NodeTime:
    """Follows the node's parameter ``use_sim_time``."""

    def __init__(
        self,
        node: Node,
        loop: Loop,
        sim_time: SimTimeSource,
        on_switch: Callable[[], None] = lambda: None,
    ) -> None:
        """``on_switch`` is called when the node has switched to or from simulated time."""
        self._loop = loop
        self._sim_time = sim_time
        self._on_switch = on_switch
        self._sim_timers = SimTimers(loop)
        self._delayed_calls: set[_DelayedCall] = set()
        self.is_simulated = False
        self._ros = cast("ROSClock", node.get_clock())
        # rclpy's time source still follows the parameter and switches the clock, but without its
        # node it does not subscribe.
        node._time_source.detach_node()
        self._virtual = loop.clock if isinstance(loop.clock, VirtualClock) else None
        if self._virtual is None:
            node.add_post_set_parameters_callback(self._follow_parameter)
        else:  # whatever the parameter says, there is one time
            node.add_post_set_parameters_callback(self._keep_virtual_time)
            self._keep_virtual_time()
            self._virtual.follow(self._set_virtual_time)

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> _DelayedCall:
        """Call ``callback`` on the node's loop once, ``delay_s`` seconds from now.

        The delay starts again when the node switches to or from simulated time.
        """
        call = _DelayedCall(self, delay_s, callback)
        self._delayed_calls.add(call)
        call.start()
        return call

    def call_every(self, period_s: float, callback: Callable[[], object]) -> TimerHandle:
        """Call ``callback`` on the node's loop each ``period_s`` seconds.

        It uses the node's current time: the caller schedules it again after a switch. Raises
        ValueError for a period that is not positive.
        """
        if self.is_simulated:
            return self._sim_timers.add(period_s, callback, repeats=True)
        return self._loop.call_every(period_s, callback)

    def close(self) -> None:
        """Stop following /clock."""
        if self.is_simulated:
            self._sim_time.leave(self._set_time)
        if self._virtual is not None:
            self._virtual.unfollow(self._set_virtual_time)

    def schedule(self, delay_s: float, callback: Callable[[], object]) -> TimerHandle:
        """Call ``callback`` once, by the node's current time."""
        if self.is_simulated:
            return self._sim_timers.add(delay_s, callback)
        return self._loop.call_later(delay_s, callback)

    def discard(self, call: _DelayedCall) -> None:
        """Forget a call that was made or canceled."""
        self._delayed_calls.discard(call)

    def _follow_parameter(self, parameters: Iterable[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == USE_SIM_TIME_NAME and parameter.value != self.is_simulated:
                self._switch(simulated=bool(parameter.value))

    def _switch(self, *, simulated: bool) -> None:
        self.is_simulated = simulated
        if simulated:
            self._sim_time.join(self._set_time)
        else:
            self._sim_time.leave(self._set_time)
            self._set_time(UNKNOWN)
        for call in tuple(self._delayed_calls):
            call.start()
        self._on_switch()

    def _keep_virtual_time(self, _: object = ()) -> None:
        self._ros._set_ros_time_is_active(True)

    def _set_virtual_time(self, now_ns: int) -> None:
        self._ros.set_ros_time_override(Time(nanoseconds=now_ns, clock_type=ClockType.ROS_TIME))

    def _set_time(self, now: Time) -> None:
        self._ros.set_ros_time_override(now)
        self._sim_timers.set_time(now.nanoseconds)


class _DelayedCall:
    """A call after a delay, by whichever time the node has."""

    __slots__ = ("_callback", "_clock", "_delay_s", "_timer")

    def __init__(self, clock: NodeTime, delay_s: float, callback: Callable[[], object]) -> None:
        self._clock = clock
        self._delay_s = delay_s
        self._callback = callback
        self._timer: TimerHandle | None = None

    def start(self) -> None:
        """Start the delay now."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._clock.schedule(self._delay_s, self._call)

    def cancel(self) -> None:
        """Never call."""
        self._clock.discard(self)
        if self._timer is not None:
            self._timer.cancel()

    def _call(self) -> Any:
        self._clock.discard(self)
        return self._callback()
