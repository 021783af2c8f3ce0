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

from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import Taken
from composer.runtime.metrics.repeat_limit import RepeatLimit

NANOSECONDS = 1_000_000_000
_NEVER = math.inf


class SimTimer:
    """A call that is due ``delay_ns`` after its creation, and periodically if ``repeats``."""

    __slots__ = ("_timers", "callback", "cancelled", "delay_ns", "due_ns", "repeats")

    def __init__(
        self,
        timers: SimTimers,
        delay_s: float,
        callback: Callable[[], object],
        *,
        repeats: bool,
    ) -> None:
        """Raise ValueError for a period that is not positive and a delay that is NaN."""
        if repeats and not delay_s > 0:
            raise ValueError(f"a period must be positive, not {delay_s:g} s")
        if math.isnan(delay_s):
            raise ValueError("a delay must be a number")
        self._timers = timers
        self.delay_ns: float = (
            max(round(delay_s * NANOSECONDS), int(repeats)) if math.isfinite(delay_s) else delay_s
        )
        self.due_ns: float = 0
        self.callback = callback
        self.repeats = repeats
        self.cancelled = False

    @property
    def late_s(self) -> float:
        """How long ago the call was due, in seconds of the simulation."""
        return (self._timers.now_ns - self.due_ns) / NANOSECONDS

    def cancel(self) -> None:
        """Never call again."""
        self.cancelled = True
        self._timers.discard(self)


class SimTimers:
    """The timers of one node; few, so that no heap is needed. From any thread.

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
        self._waiting: set[SimTimer] = set()
        self._next_ns: float = _NEVER
        self.now_ns = 0

    def add(
        self, delay_s: float, callback: Callable[[], object], *, repeats: bool = False
    ) -> SimTimer:
        """Call ``callback`` ``delay_s`` seconds of the simulation from now."""
        timer = SimTimer(self, delay_s, callback, repeats=repeats)
        if timer.delay_ns <= 0:
            self._loop.call_soon(partial(self._call, timer))
            return timer
        with self._changing:
            self._wait_for(timer, self.now_ns + timer.delay_ns)
        return timer

    def discard(self, timer: SimTimer) -> None:
        """Stop waiting for a timer."""
        with self._changing:
            self._waiting.discard(timer)

    def set_time(self, now_ns: int) -> None:
        """Advance to ``now_ns`` and make all calls that are due."""
        with self._changing:
            before_ns, self.now_ns = self.now_ns, now_ns
            if before_ns == 0:
                self._reschedule(lambda timer: now_ns + timer.delay_ns)
            elif now_ns < before_ns:
                self._reschedule(lambda timer: min(timer.due_ns, now_ns + timer.delay_ns))
            due = self._pop_due() if now_ns >= self._next_ns else ()
        for timer in due:
            self._loop.call_soon(partial(self._call, timer))

    def _wait_for(self, timer: SimTimer, due_ns: float) -> None:
        timer.due_ns = due_ns
        self._waiting.add(timer)
        self._next_ns = min(self._next_ns, due_ns)

    def _reschedule(self, due_ns: Callable[[SimTimer], float]) -> None:
        self._next_ns = _NEVER
        for timer in self._waiting:
            self._wait_for(timer, due_ns(timer))

    def _pop_due(self) -> list[SimTimer]:
        now_ns = self.now_ns
        due = sorted(
            (timer for timer in self._waiting if timer.due_ns <= now_ns),
            key=lambda timer: timer.due_ns,
        )
        self._waiting.difference_update(due)
        self._next_ns = min((timer.due_ns for timer in self._waiting), default=_NEVER)
        return due

    def _call(self, timer: SimTimer) -> None:
        if timer.cancelled:
            return
        try:
            timer.callback()
        finally:
            if timer.repeats:
                self._repeat(timer)

    def _repeat(self, timer: SimTimer) -> None:
        """Wait for the next multiple of the period in the future."""
        with self._changing:
            if timer.cancelled:
                return
            late_ns = self.now_ns - timer.due_ns
            if late_ns < 0:  # time has jumped back since it was due
                self._wait_for(timer, self.now_ns + timer.delay_ns)
            else:
                periods = late_ns // timer.delay_ns + 1
                self._wait_for(timer, timer.due_ns + periods * timer.delay_ns)


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
