"""A command's own short-lived node in the ROS graph: it joins, waits on what it needs, leaves.

Discovery tells nobody when it is complete. What is asked for by name is there as soon as it is
seen. For all else, what is seen counts once nobody on this computer is left to be met and nothing
has come for a moment.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Hashable
from typing import Any, Self, TypeVar

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rclpy.utilities import get_rmw_implementation_identifier

from composer.runtime.process import dds_profiles as discovery
from composer.runtime.process.dds_participants import count_participants, enlarge_receive_buffers
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.ros.endpoints import NO_NAME
from composer.runtime.ros.manager_protocol import NAME

T = TypeVar("T")
H = TypeVar("H", bound=Hashable)

_STEP_S = 0.01
#: What a participant has comes at once, 0.1 to 0.2 s after it was met; what was lost of it, 0.11 s
#: later. Fast DDS 2 has these times in EDPUtils.hpp and no setting for them.
_QUIET_S = 0.15
#: So long is waited for the first of all others: one in another computer shows nothing before.
_FIRST_S = 0.5
#: Who is not met at once is met with its next announcement, with Fast DDS at most 3 s later.
_MET_WITHIN_S = 3.5
#: Each participant of ROS 2 has it; its name is as it is on the wire.
_TOPIC_OF_PARTICIPANTS = "ros_discovery_info"
#: The part of an endpoint's id that is its participant's (DDSI-RTPS, 9.3.1).
_PARTICIPANT_BYTES = 12
#: Commands do not count as somebody: they come and go.
_NAME_PREFIX = "_compose_"


class RosError(Exception):
    """Something asked of the ROS graph came to nothing; ``hint`` says what would not."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


class NoAnswer(RosError):
    """A node or a service of it did not do its part within the time limit."""


class Deadline:
    """A point in time that everything a command waits for shares."""

    def __init__(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._end = time.monotonic() + timeout_s

    @property
    def left_s(self) -> float:
        """The seconds that are left, at least 0."""
        return max(0.0, self._end - time.monotonic())

    @property
    def passed(self) -> bool:
        """Whether nothing is left."""
        return self.left_s <= 0.0


def use_command_profile() -> None:
    """Have this process do without shared memory: see :mod:`composer.runtime.process.dds_profiles`.

    For commands that do not carry large messages, before they join the ROS graph.
    """
    if get_rmw_implementation_identifier().startswith("rmw_fastrtps"):
        discovery.use_command_profile(os.environ)


class _Member(Node):
    """A node that has room for the announcements of others before they come.

    ``joined_s`` is when it joined the graph, on the clock of time.monotonic.
    """

    joined_s = 0.0

    def create_publisher(self, *args: Any, **options: Any) -> Any:
        """Create a publisher. The first one is a node's own, made right after its participant."""
        if not self.joined_s:
            self.joined_s = time.monotonic()
            enlarge_receive_buffers()
        return super().create_publisher(*args, **options)


class Session:
    """The node, hidden from node lists by its leading underscore. Use it in a ``with`` block."""

    def __init__(self) -> None:
        self._context = Context()
        # No signal handlers come with it: Ctrl-C stays Python's KeyboardInterrupt.
        self._context.init([])
        self.node = _Member(
            f"{_NAME_PREFIX}{os.getpid()}",
            context=self._context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[Parameter("start_type_description_service", value=False)],
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._domain_id = self._context.get_domain_id()
        self._quiet = _Quiet()
        self._quiet.since_s(self._met())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown(timeout_sec=1.0)
        self.node.destroy_node()
        self._context.try_shutdown()

    def others(self) -> tuple[tuple[str, str], ...]:
        """Return name and namespace of every node known now but those of commands."""
        return tuple(
            sorted(
                (name, namespace)
                for name, namespace in self.node.get_node_names_and_namespaces()
                if not name.startswith(_NAME_PREFIX)
            )
        )

    def silent_systems(self) -> dict[str, str]:
        """Return the systems that composers run on this computer and that are not met, by name.

        With their processes, which are stopped or busy. What is met lacks their nodes.
        """
        met = set(self.others())
        return {name: pid for name, pid in local_systems().items() if (NAME, name) not in met}

    def spin_once(self, deadline: Deadline) -> None:
        """Wait for something to come in, for a moment and not beyond the deadline."""
        self._executor.spin_once(timeout_sec=min(_STEP_S, deadline.left_s))

    def wait_for(self, look: Callable[[], T | None], deadline: Deadline) -> T | None:
        """Return what ``look`` finds as soon as it finds something; None at the deadline."""
        while True:
            found = look()
            if found is not None or deadline.passed:
                return found
            self.spin_once(deadline)

    def wait_until_still(self, look: Callable[[], H], deadline: Deadline) -> H:
        """Return what ``look`` finds once everything is discovered, or at the deadline."""
        found = _Quiet()
        while True:
            seen = look()
            if self._is_all_discovered(found.since_s(seen)) or deadline.passed:
                return seen
            self.spin_once(deadline)

    def search(self, look: Callable[[], H | None], deadline: Deadline) -> H | None:
        """Return what ``look`` finds as soon as it finds something.

        None once everything is discovered, or at the deadline.
        """
        began_s = time.monotonic()
        while True:
            found = look()
            if found is not None or self._is_all_discovered(began_s) or deadline.passed:
                return found
            self.spin_once(deadline)

    def _is_all_discovered(self, unchanged_since_s: float) -> bool:
        """Say whether nobody is left to be met. What is asked for has not changed since then."""
        met, others = self._met()
        quiet_since_s = self._quiet.since_s((met, others))
        ready_s = max(quiet_since_s, unchanged_since_s) + _QUIET_S
        if not others:
            ready_s = max(ready_s, self.node.joined_s + _FIRST_S)
        now_s = time.monotonic()
        if now_s < ready_s:
            return False
        if now_s >= self.node.joined_s + _MET_WITHIN_S:
            return True
        return met >= count_participants(self._domain_id) and self._have_all_told()

    def _have_all_told(self) -> bool:
        """Say whether each participant's nodes are known: it tells of them last."""
        node = self.node
        met = node.get_publishers_info_by_topic(_TOPIC_OF_PARTICIPANTS, no_mangle=True)
        publishers = [
            end
            for topic, _ in node.get_topic_names_and_types()
            for end in node.get_publishers_info_by_topic(topic)
        ]
        named = [end for end in publishers if end.node_name != NO_NAME]
        told = {_participant(end) for end in named}
        return len(named) == len(publishers) and told.issuperset(map(_participant, met))

    def _met(self) -> tuple[int, tuple[tuple[str, str], ...]]:
        """Return the number of participants known now, this one included, and the nodes.

        Publishers and subscriptions are announced apart: known is of whom both have come.
        """
        node, topic = self.node, _TOPIC_OF_PARTICIPANTS
        publishers = node.get_publishers_info_by_topic(topic, no_mangle=True)
        subscriptions = node.get_subscriptions_info_by_topic(topic, no_mangle=True)
        return min(len(publishers), len(subscriptions)), self.others()


def _participant(end: TopicEndpointInfo) -> bytes:
    return bytes(end.endpoint_gid[:_PARTICIPANT_BYTES])


class _Quiet:
    """Since when something looks as it does."""

    def __init__(self) -> None:
        self._seen: Hashable = None
        self._since_s = time.monotonic()

    def since_s(self, seen: Hashable) -> float:
        """Return since when it looks like that, on the clock of time.monotonic."""
        if seen != self._seen:
            self._seen, self._since_s = seen, time.monotonic()
        return self._since_s
