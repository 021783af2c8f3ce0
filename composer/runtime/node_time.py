"""The time of a node (system, steady, or simulated from /clock), and calls scheduled by it.

With the parameter ``use_sim_time``, the time is read from /clock. Otherwise it is read from the
system clock, and calls are scheduled by the steady clock, which nothing adjusts.

In rclpy each node that uses simulated time has its own subscription: an endpoint per node, and the
same message taken as often as there are nodes. Here one subscription serves all of them.

Timers count whole nanoseconds, as rcl does: the steps of a simulator are exact multiples of the
timers' periods, and sums of fractions would just miss them.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, TypeAlias, cast

from rclpy.clock import ROSClock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.time import Time
from rclpy.time_source import CLOCK_TOPIC, USE_SIM_TIME_NAME
from rosgraph_msgs.msg import Clock as ClockMessage

from composer.runtime.clock import VirtualClock
from composer.runtime.executors.base_loop import ScheduledCall, TimerQueue
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import Taken
from composer.runtime.metrics.repeat_limit import RepeatLimit

NANOSECONDS = 1_000_000_000
#: As rclpy and rclcpp subscribe: only the latest time matters.
_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
_WARNING_PERIOD_S = 10.0
#: In ROS, zero means that no time was received yet.
UNKNOWN = Time(clock_type=ClockType.ROS_TIME)
#: Called with each new time; must be fast and must not raise.
Follower: TypeAlias = Callable[[Time], None]
#: As often as simulators do by default.
_CLOCK_PERIOD_S = 0.01


class SimTimer(ScheduledCall):
    """A call of :class:`SimTimers`; its times are in nanoseconds."""

    __slots__ = ("delay_ns",)

    per_s = NANOSECONDS

    def __init__(
        self, timers: SimTimers, delay_ns: float, callback: Callable[[], object], *, repeats: bool
    ) -> None:
        """Raise ValueError for a period that is not positive and a delay that is NaN."""
        super().__init__(
            lambda: timers.now_ns, timers.now_ns + delay_ns, delay_ns if repeats else None, callback
        )
        self.delay_ns = delay_ns


class SimTimers:
    """The timers of one node, and the time that they count. From any thread.

    Time advances only by :meth:`set_time`. When it jumps:

    - forward: a timer that is due is called once, whatever number of periods has passed;
    - backward: no timer waits longer than its period or delay from the new time on
      (rcl/src/rcl/timer.c, ``_rcl_timer_time_jump``);
    - from zero, which means unknown: all delays start.
    """

    def __init__(self, loop: Loop) -> None:
        """Make the calls on ``loop``."""
        self._loop = loop
        self._changing = threading.Lock()
        self._waiting = TimerQueue[SimTimer](lambda: self.now_ns)
        self.now_ns = 0

    def add(
        self, delay_s: float, callback: Callable[[], object], *, repeats: bool = False
    ) -> SimTimer:
        """Call ``callback`` ``delay_s`` seconds of the simulation from now.

        Raises ValueError for a period that is not positive and a delay that is NaN.
        """
        delay_ns = delay_s
        if math.isfinite(delay_s):
            delay_ns = round(delay_s * NANOSECONDS) or int(repeats and delay_s > 0)
        with self._changing:
            timer = SimTimer(self, delay_ns, callback, repeats=repeats)
            if delay_ns > 0:
                self._waiting.add(timer)
                return timer
        self._loop.call_soon(partial(self._call, timer))
        return timer

    def set_time(self, now_ns: int) -> None:
        """Advance to ``now_ns`` and make all calls that are due."""
        waiting = self._waiting
        due: list[SimTimer] = []
        with self._changing:
            before_ns, self.now_ns = self.now_ns, now_ns
            if before_ns == 0:
                waiting.move(lambda timer: now_ns + timer.delay_ns)
            elif now_ns < before_ns:
                waiting.move(lambda timer: min(timer.due_s, now_ns + timer.delay_ns))
            while waiting.next_due_s() <= now_ns:
                due.append(waiting.pop())
        for timer in due:
            self._loop.call_soon(partial(self._call, timer))

    def _call(self, timer: SimTimer) -> None:
        try:
            if not timer.cancelled:
                timer.callback()
        finally:
            with self._changing:
                # The time may have jumped back since it was due.
                timer.due_s = min(timer.due_s, self.now_ns)
                self._waiting.reschedule(timer)


class SimTimeSource:
    """Passes the time of /clock to its followers. It subscribes only while there are any."""

    def __init__(self, node: Node, loop: Loop, warn: Callable[[str], None]) -> None:
        """Subscribe with ``node``, on ``loop``; call ``warn`` for times that are not valid."""
        self._node = node
        self._warn = warn
        self._repeats = RepeatLimit(loop.clock, _WARNING_PERIOD_S)
        self._loop = loop
        self._changing = threading.Lock()  # a follower that has left is not called
        self._followers: set[Follower] = set()
        self._now = UNKNOWN
        self._subscription: Subscription | None = None

    def join(self, follower: Follower) -> None:
        """Call ``follower`` with the current time, or :data:`UNKNOWN`, and with each later one.

        From any thread; later calls are made on the loop.
        """
        with self._changing:
            self._followers.add(follower)
            follower(self._now)
        self._loop.call_soon(self._update_subscription)

    def leave(self, follower: Follower) -> None:
        """Stop calling ``follower``. From any thread."""
        with self._changing:
            self._followers.discard(follower)
        self._loop.call_soon(self._update_subscription)

    def _update_subscription(self) -> None:
        if self._followers and self._subscription is None:
            self._subscription = self._node.create_subscription(
                ClockMessage, CLOCK_TOPIC, self._on_clock, _QOS
            )
            self._loop.add_subscription(self._subscription, self._on_clock)
        elif not self._followers and self._subscription is not None:
            self._loop.remove(self._subscription)
            self._now = UNKNOWN  # an outdated time must not be a starting point
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def _on_clock(self, taken: Taken) -> None:
        message: ClockMessage = taken[0]
        try:
            now = Time.from_msg(message.clock)
        except (ValueError, OverflowError) as error:
            text = f"ignored a time of {CLOCK_TOPIC}: {error}"
            self._repeats.warn(self._warn, CLOCK_TOPIC, text)
            return
        with self._changing:
            self._now = now
            for follower in self._followers:
                follower(now)


def publish_clock(node: Node, loop: Loop) -> None:
    """Publish the time of ``loop`` on /clock, as long as the loop runs."""
    publisher = node.create_publisher(ClockMessage, CLOCK_TOPIC, _QOS)

    def publish() -> None:
        now = Time(nanoseconds=loop.clock.time_ns())
        publisher.publish(ClockMessage(clock=now.to_msg()))

    loop.call_soon(publish)
    loop.call_every(_CLOCK_PERIOD_S, publish)


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

    def call_every(self, period_s: float, callback: Callable[[], object]) -> ScheduledCall:
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

    def schedule(self, delay_s: float, callback: Callable[[], object]) -> ScheduledCall:
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
        self._timer: ScheduledCall | None = None

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
