"""The short-lived node of a command: it joins the ROS graph, waits for what it needs and leaves.

DDS does not signal the end of discovery. An entity that is looked up by name is used as soon as it
is discovered. A listing counts as complete once all participants on this computer are discovered
and nothing has changed for a moment.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any, Self, TypeVar

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.utilities import get_rmw_implementation_identifier

from composer.runtime.middleware import environment
from composer.runtime.middleware.environment import ROS_ARGUMENTS
from composer.runtime.middleware.local_resources import count_participants, enlarge_receive_buffers
from composer.runtime.process import start_refused
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.protocol.requests import NAME
from composer.runtime.ros.graph import COMMAND_PREFIX, SETTLE_S, NodeName, RosGraph

T = TypeVar("T")

_SPIN_S = 0.01
#: How long to wait for the first other node, which may be on another computer.
_FIRST_NODE_S = 0.5
#: Fast DDS repeats the announcement of a participant every 3 s.
_ANNOUNCED_WITHIN_S = 3.5


class RosError(Exception):
    """An operation in the ROS graph failed; ``hint`` says how to proceed."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


class NoResponseError(RosError):
    """A node or service did not respond within the time limit."""


class Deadline:
    """A time limit that all waits of a command share."""

    def __init__(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._end = time.monotonic() + timeout_s

    @property
    def left_s(self) -> float:
        """The remaining seconds, at least 0."""
        return max(0.0, self._end - time.monotonic())

    @property
    def passed(self) -> bool:
        """Whether no time remains."""
        return self.left_s <= 0.0

    def at_most(self, seconds: float) -> Deadline:
        """Return a time limit from now on that ends no later than this one."""
        return Deadline(min(seconds, self.left_s))


def use_command_profile() -> None:
    """Disable shared memory in this process: see :mod:`composer.runtime.middleware.environment`.

    For commands that carry no large messages. Call it before joining the ROS graph.
    """
    if get_rmw_implementation_identifier().startswith("rmw_fastrtps"):
        environment.use_command_profile(os.environ)


class _SessionNode(Node):
    """A node that enlarges the receive buffers before the announcements of other nodes arrive.

    ``joined_s`` is when it joined the graph (seconds, time.monotonic).
    """

    joined_s = 0.0

    def create_publisher(self, *args: Any, **options: Any) -> Any:
        """Create a publisher. The node creates the first one right after its participant."""
        if not self.joined_s:
            self.joined_s = time.monotonic()
            enlarge_receive_buffers()
        return super().create_publisher(*args, **options)


class Session:
    """A node in the ROS graph, hidden from node lists. Use it in a ``with`` block."""

    def __init__(self) -> None:
        """Join the ROS graph. Raises RosError."""
        self._context = Context()
        try:
            # Without signal handlers: Ctrl-C remains Python's KeyboardInterrupt.
            self._context.init(list(ROS_ARGUMENTS))
            self.node = _SessionNode(f"{COMMAND_PREFIX}{os.getpid()}", **self._node_options())
        except rclpy_implementation.RCLError as error:
            self._context.try_shutdown()
            refusal = start_refused(error)
            raise RosError(str(refusal), refusal.hint) from error
        self.graph = RosGraph(self.node)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._domain_id = self._context.get_domain_id()
        self._last_discovery = _LastChange()
        self._last_discovery.at_s(self._discovered())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown(timeout_sec=1.0)
        self.node.destroy_node()
        self._context.try_shutdown()

    def _node_options(self) -> dict[str, Any]:
        """Return the arguments of a node of this session, which has no services."""
        return {
            "context": self._context,
            "use_global_arguments": False,
            "enable_rosout": False,
            "start_parameter_services": False,
            "parameter_overrides": [Parameter("start_type_description_service", value=False)],
        }

    def is_local_discovered(self) -> bool:
        """Return whether all nodes of this computer are discovered."""
        count = len(self.graph.participants())
        return count >= count_participants(self._domain_id) and self.graph.are_nodes_known()

    def unresponsive_systems(self) -> dict[str, str]:
        """Return the systems of this computer that are not discovered, with their process ids.

        Their processes are stopped or busy, so their nodes are not known.
        """
        known = set(self.graph.others())
        return {name: pid for name, pid in local_systems().items() if (NAME, name) not in known}

    def spin_once(self, deadline: Deadline) -> None:
        """Wait briefly for an event, not beyond the deadline."""
        self._executor.spin_once(timeout_sec=min(_SPIN_S, deadline.left_s))

    def spin_until(self, at_s: float) -> None:
        """Handle events until a time of time.monotonic."""
        pause = Deadline(at_s - time.monotonic())
        while not pause.passed:
            self.spin_once(pause)

    def wait_for(self, poll: Callable[[], T], deadline: Deadline) -> T:
        """Return the first result of ``poll`` that is true; the last one at the deadline."""
        return self._polled(poll, bool, deadline)

    def wait_until_settled(self, poll: Callable[[], T], deadline: Deadline) -> T:
        """Return the result of ``poll`` once discovery is complete, or at the deadline."""
        last_change = _LastChange()
        return self._polled(
            poll, lambda found: self._is_discovery_complete(last_change.at_s(found)), deadline
        )

    def search(self, poll: Callable[[], T], deadline: Deadline) -> T:
        """Return the first result of ``poll`` that is true.

        Returns the last one once discovery is complete, or at the deadline.
        """
        started_s = time.monotonic()
        return self._polled(
            poll, lambda found: bool(found) or self._is_discovery_complete(started_s), deadline
        )

    def _polled(self, poll: Callable[[], T], is_last: Callable[[T], bool], deadline: Deadline) -> T:
        while True:
            found = poll()
            if is_last(found) or deadline.passed:
                return found
            self.spin_once(deadline)

    def _is_discovery_complete(self, unchanged_since_s: float) -> bool:
        """Say whether all participants are discovered, given when the result last changed."""
        count, others = self._discovered()
        last_change_s = self._last_discovery.at_s((count, others))
        ready_s = max(last_change_s, unchanged_since_s) + SETTLE_S
        if not others:
            ready_s = max(ready_s, self.node.joined_s + _FIRST_NODE_S)
        now_s = time.monotonic()
        if now_s < ready_s:
            return False
        if now_s >= self.node.joined_s + _ANNOUNCED_WITHIN_S:
            return True
        return self.is_local_discovered()

    def _discovered(self) -> tuple[int, tuple[NodeName, ...]]:
        """Return the number of known participants, including this one, and the nodes."""
        return len(self.graph.participants()), self.graph.others()


class _LastChange:
    """When a polled value last changed."""

    def __init__(self) -> None:
        self._value: object = None
        self._at_s = time.monotonic()

    def at_s(self, value: object) -> float:
        """Return when the value last changed (seconds, time.monotonic), given its current value."""
        if value != self._value:
            self._value, self._at_s = value, time.monotonic()
        return self._at_s
