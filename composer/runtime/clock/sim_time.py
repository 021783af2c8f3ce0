"""What /clock says, for all nodes of a process.

rclpy has each node that uses simulated time subscribe by itself, which is an endpoint a node and
the same message taken as often as there are nodes. Here one subscription serves all of them.
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

from composer.runtime.executors.loop import Loop, Taken

#: As rclpy and rclcpp subscribe: only the latest time matters.
_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
#: ROS takes zero for a time that nobody has told yet.
UNKNOWN = Time(clock_type=ClockType.ROS_TIME)

#: Is given each new time; must be quick and raise nothing.
Follower: TypeAlias = Callable[[Time], None]


class SimulatedTime:
    """Gives the time of /clock to whoever follows it, and listens only while somebody does."""

    def __init__(self, node: Node, loop: Loop) -> None:
        """Listen with a subscription of ``node``, which ``loop`` serves."""
        self._node = node
        self._loop = loop
        self._changing = threading.Lock()  # who has left is not called any more
        self._followers: set[Follower] = set()
        self._now = UNKNOWN
        self._subscription: Subscription | None = None

    def join(self, follower: Follower) -> None:
        """Tell ``follower`` the time now, :data:`UNKNOWN` before it was told, and each later one.

        From any thread; ``follower`` is called on the loop from then on.
        """
        with self._changing:
            self._followers.add(follower)
            follower(self._now)
        self._loop.call_soon(self._listen_while_wanted)

    def leave(self, follower: Follower) -> None:
        """Tell ``follower`` nothing more. From any thread."""
        with self._changing:
            self._followers.discard(follower)
        self._loop.call_soon(self._listen_while_wanted)

    def _listen_while_wanted(self) -> None:
        if self._followers and self._subscription is None:
            self._subscription = self._node.create_subscription(
                ClockMessage, CLOCK_TOPIC, self._take, _QOS
            )
            self._loop.add_subscription(self._subscription, self._take)
        elif not self._followers and self._subscription is not None:
            self._loop.remove(self._subscription)
            self._now = UNKNOWN  # what was heard long ago is no time to start from
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def _take(self, taken: Taken) -> None:
        message: ClockMessage = taken[0]
        now = Time.from_msg(message.clock)
        with self._changing:
            self._now = now
            for follower in self._followers:
                follower(now)
