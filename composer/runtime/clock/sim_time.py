"""The time of /clock, for all nodes of a process.

In rclpy each node that uses simulated time has its own subscription: an endpoint per node, and the
same message taken as often as there are nodes. Here one subscription serves all of them.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeAlias

from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.time import Time
from rclpy.time_source import CLOCK_TOPIC
from rosgraph_msgs.msg import Clock as ClockMessage

from composer.runtime.executors.entities.sources import Taken
from composer.runtime.executors.loop import Loop
from composer.runtime.metrics.repeat_limit import RepeatLimit

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
        self._repeats = RepeatLimit(_WARNING_PERIOD_S)
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
            admission = self._repeats.admit(CLOCK_TOPIC)
            if admission is not None:
                self._warn(f"ignored a time of {CLOCK_TOPIC}: {error}{admission.suffix}")
            return
        with self._changing:
            self._now = now
            for follower in self._followers:
                follower(now)
