"""The time of /clock, for all nodes of a process, and timers of a node in that time.

In rclpy each node that uses simulated time has its own subscription: an endpoint per node, and the
same message taken as often as there are nodes. Here one subscription serves all of them.

Timers count whole nanoseconds, as rcl does: the steps of a simulator are exact multiples of the
timers' periods, and sums of fractions would just miss them.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from functools import partial
from typing import TypeAlias

from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.time import Time
from rclpy.time_source import CLOCK_TOPIC
from rosgraph_msgs.msg import Clock as ClockMessage

from composer.runtime.executors.base_loop import ScheduledCall, TimerQueue
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import Taken
from composer.runtime.metrics.repeat_limit import RepeatLimit

NANOSECONDS = 1_000_000_000


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


#: As rclpy and rclcpp subscribe: only the latest time matters.
_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
_WARNING_PERIOD_S = 10.0
#: In ROS, zero means that no time was received yet.
UNKNOWN = Time(clock_type=ClockType.ROS_TIME)

#: Called with each new time; must be fast and must not raise.
Follower: TypeAlias = Callable[[Time], None]


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


#: As often as simulators do by default.
_CLOCK_PERIOD_S = 0.01


def publish_clock(node: Node, loop: Loop) -> None:
    """Publish the time of ``loop`` on /clock, as long as the loop runs."""
    publisher = node.create_publisher(ClockMessage, CLOCK_TOPIC, _QOS)

    def publish() -> None:
        now = Time(nanoseconds=loop.clock.time_ns())
        publisher.publish(ClockMessage(clock=now.to_msg()))

    loop.call_soon(publish)
    loop.call_every(_CLOCK_PERIOD_S, publish)
