"""A node's clock: what time it is for the node, and calls at a time by it.

In simulated time (the parameter ``use_sim_time``) that is the time of /clock; otherwise now is what
the computer's clock says, and calls go by the steady clock, which nobody sets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, cast

from rclpy.clock import ROSClock
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from rclpy.time_source import USE_SIM_TIME_NAME

from composer.runtime.clock.sim_time import UNKNOWN, SimulatedTime
from composer.runtime.clock.sim_timers import SimulatedCalls
from composer.runtime.executors.loop import Loop, Timer


class Clock:
    """Follows the node's parameter ``use_sim_time``."""

    def __init__(
        self,
        node: Node,
        loop: Loop,
        simulated_time: SimulatedTime,
        switched: Callable[[], None] = lambda: None,
    ) -> None:
        """``switched`` is called when the node's time has become another."""
        self._loop = loop
        self._simulated_time = simulated_time
        self._switched = switched
        self._calls = SimulatedCalls(loop)
        self._waits: set[_Wait] = set()
        self.is_simulated = False
        self._ros = cast(ROSClock, node.get_clock())
        # rclpy's source of time goes on to watch the parameter and to switch the clock, but
        # without its node it subscribes to nothing.
        node._time_source.detach_node()
        node.add_post_set_parameters_callback(self._follow_parameter)

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> _Wait:
        """Call ``callback`` on the node's loop once, ``delay_s`` seconds from now.

        When the node's time becomes another the delay begins anew.
        """
        wait = _Wait(self, delay_s, callback)
        self._waits.add(wait)
        wait.begin()
        return wait

    def call_every(self, period_s: float, callback: Callable[[], object]) -> Timer:
        """Call ``callback`` on the node's loop each ``period_s`` seconds.

        It goes by the time that the node has now: whoever asked asks anew when that was switched.
        Raises ValueError for a period that is not positive.
        """
        if self.is_simulated:
            return self._calls.add(period_s, callback, repeats=True)
        return self._loop.call_every(period_s, callback)

    def close(self) -> None:
        """Follow nothing more."""
        if self.is_simulated:
            self._simulated_time.leave(self._take_time)

    def schedule(self, delay_s: float, callback: Callable[[], object]) -> Timer:
        """Call ``callback`` once, by the time that the node has now."""
        if self.is_simulated:
            return self._calls.add(delay_s, callback)
        return self._loop.call_later(delay_s, callback)

    def forget(self, wait: _Wait) -> None:
        """Let a wait be: it is over."""
        self._waits.discard(wait)

    def _follow_parameter(self, parameters: Iterable[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == USE_SIM_TIME_NAME and parameter.value != self.is_simulated:
                self._switch(simulated=bool(parameter.value))

    def _switch(self, *, simulated: bool) -> None:
        self.is_simulated = simulated
        if simulated:
            self._simulated_time.join(self._take_time)
        else:
            self._simulated_time.leave(self._take_time)
            self._take_time(UNKNOWN)
        for wait in tuple(self._waits):
            wait.begin()
        self._switched()

    def _take_time(self, now: Time) -> None:
        self._ros.set_ros_time_override(now)
        self._calls.take_time(now.nanoseconds)


class _Wait:
    """A call at a time, whichever time it is."""

    __slots__ = ("_callback", "_clock", "_delay_s", "_timer")

    def __init__(self, clock: Clock, delay_s: float, callback: Callable[[], object]) -> None:
        self._clock = clock
        self._delay_s = delay_s
        self._callback = callback
        self._timer: Timer | None = None

    def begin(self) -> None:
        """Begin to wait, now."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._clock.schedule(self._delay_s, self._end)

    def cancel(self) -> None:
        """Never call."""
        self._clock.forget(self)
        if self._timer is not None:
            self._timer.cancel()

    def _end(self) -> Any:
        self._clock.forget(self)
        return self._callback()
