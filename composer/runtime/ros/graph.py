"""The ROS graph as a node has discovered it: participants, and the names of everything in it.

Names that are not valid in ROS are left out. ROS checks names where they are created, but other DDS
software may announce anything: a topic ``/``, a node without a name. rcl then refuses whole
queries, and a single participant would keep every command from working.
"""

from __future__ import annotations

import ctypes
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Set
from functools import lru_cache
from importlib import import_module
from types import ModuleType
from typing import TypeAlias

from rclpy.exceptions import NameValidationException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name

from composer.base.characters import shortened
from composer.model import ChannelKind, PortKind
from composer.model.names import join_node_name
from composer.runtime.middleware.local_resources import ended_participants
from composer.runtime.protocol.requests import NameAndTypes

#: The name and the namespace of a node.
NodeName: TypeAlias = tuple[str, str]

#: The nodes of commands, which are left out of listings.
COMMAND_PREFIX = "_compose_"
#: The endpoints of a participant arrive 0.1 to 0.2 s after the participant itself; lost
#: announcements are repeated 0.11 s later. Fast DDS 2 defines these times in EDPUtils.hpp.
SETTLE_S = 0.15
#: rmw's node name of an endpoint whose participant has not reported its nodes yet.
UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
#: The length of the participant's prefix in the id of an endpoint (DDSI-RTPS, 9.3.1).
PARTICIPANT_BYTES = 12
#: The topic with which each ROS 2 participant announces its nodes, by its DDS name.
_PARTICIPANTS_TOPIC = "ros_discovery_info"
_KNOWN_NAMES = 50_000  # of the largest systems, several times
_MAX_LISTED = 3
_MAX_SKIPPED = 1000
_INVALID = "not a valid name in ROS"
#: Queries that raise one of these concern a node that has left, or that announces odd names.
_REFUSED = (RuntimeError, ValueError, NameValidationException)


#: The part of the names of rclpy's queries.
_QUERIES = {
    PortKind.PUBLISHER: "publisher",
    PortKind.SUBSCRIPTION: "subscriber",
    PortKind.SERVICE: "service",
    PortKind.CLIENT: "client",
    PortKind.ACTION_SERVER: "action_server",
    PortKind.ACTION_CLIENT: "action_client",
}


class Skipped:
    """What was left out because it is not valid, for one warning at the end of a command."""

    def __init__(self) -> None:
        self._found: dict[str, dict[str, None]] = {}

    def add(self, reason: str, what: str) -> None:
        """Add ``what``, which was skipped because of ``reason``."""
        found = self._found.setdefault(reason, {})
        if len(found) < _MAX_SKIPPED:
            found[what] = None

    def __bool__(self) -> bool:
        return bool(self._found)

    def warnings(self) -> tuple[str, ...]:
        """Return a warning for each reason."""
        return tuple(
            f"skipped {shortened(list(found), _MAX_LISTED)}: {why}"
            for why, found in self._found.items()
        )


class RosGraph:
    """Queries of the ROS graph as ``node`` has discovered it so far; ``skipped`` was left out."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.skipped = Skipped()

    def names(self, kind: str) -> tuple[NameAndTypes, ...]:
        """Return the names of all nodes, topics, services or actions, sorted, with their types.

        The nodes of commands are left out. A name that two nodes share is listed twice.
        """
        found: list[NameAndTypes]
        match kind:
            case "node":
                found = [(join_node_name(namespace, name), ()) for name, namespace in self.others()]
            case "topic":
                found = self.topics()
            case "service":
                found = self.services()
            case _:
                found = self.actions()
        return tuple(sorted(found))

    def others(self) -> tuple[NodeName, ...]:
        """Return the name and namespace of every discovered node, except nodes of commands."""
        return tuple(
            sorted(node for node in self.nodes() if not node[0].startswith(COMMAND_PREFIX))
        )

    def participants(self) -> frozenset[bytes]:
        """Return the prefixes of all discovered participants, including the node's own.

        Publishers and subscriptions are announced separately; a participant counts with both.
        """
        node, topic = self.node, _PARTICIPANTS_TOPIC
        publishers = node.get_publishers_info_by_topic(topic, no_mangle=True)
        subscriptions = node.get_subscriptions_info_by_topic(topic, no_mangle=True)
        return frozenset(map(participant, publishers)) & frozenset(map(participant, subscriptions))

    def are_nodes_known(self) -> bool:
        """Say whether each participant has announced its nodes, which it does last.

        One that was killed before never does.
        """
        node = self.node
        known = node.get_publishers_info_by_topic(_PARTICIPANTS_TOPIC, no_mangle=True)
        named, nameless = set[bytes](), set[bytes]()
        for topic, _ in self.topics():
            for endpoint in node.get_publishers_info_by_topic(topic):
                found = nameless if endpoint.node_name == UNKNOWN_NODE else named
                found.add(participant(endpoint))
        nameless |= set(map(participant, known)) - named
        return not nameless or nameless <= self._ended(nameless)

    def nodes(self) -> list[NodeName]:
        """Return all nodes; a name that two nodes share is listed twice.

        A killed process counts until DDS notices its end, unless its nodes run again.
        """
        return self.nodes_and_replaced()[0]

    def nodes_and_replaced(self) -> tuple[list[NodeName], frozenset[bytes]]:
        """Return the nodes, and the participants that have ended and whose nodes run again."""
        found = self._all_nodes()
        replaced = self._ended() if len(found) > len(set(found)) else frozenset()
        if not replaced:
            return found, replaced
        ends = {(end.node_name, end.node_namespace, participant(end)) for end in self._all_ends()}
        gone = Counter((name, namespace) for name, namespace, prefix in ends if prefix in replaced)
        return list((Counter(found) - gone).elements()), replaced

    def _ended(self, others: Set[bytes] = frozenset()) -> frozenset[bytes]:
        """Return which participants have ended; ``others`` have announced only a part."""
        known = self.participants() | others
        return ended_participants(known, self.node.context.get_domain_id())

    def _all_nodes(self) -> list[NodeName]:
        """Return the nodes of all participants that DDS knows.

        If the names of nodes arrive after the end of their participant, rmw keeps them for good. It
        has no enclave for them: a participant announces its enclave itself.
        """
        try:
            listed = self.node.get_node_names_and_namespaces_with_enclaves()
            found = [(name, namespace) for name, namespace, enclave in listed if enclave]
        except rclpy_implementation.RCLError:  # a node without a name, so rcl returns none at all
            self.skipped.add(_INVALID, "node ''")
            found = self._nodes_with_endpoints()
        return [
            (name, namespace)
            for name, namespace in found
            if self._is_valid(
                f"node '{join_node_name(namespace, name)}'", _is_node, name, namespace
            )
        ]

    def topics(self) -> list[NameAndTypes]:
        """Return all topics."""
        return self._valid("topic", self.node.get_topic_names_and_types())

    def services(self) -> list[NameAndTypes]:
        """Return all services."""
        return self._valid("service", self.node.get_service_names_and_types())

    def actions(self) -> list[NameAndTypes]:
        """Return all actions."""
        return self._valid("action", _actions().get_action_names_and_types(self.node))

    def ends_of(self, node: NodeName, kind: PortKind) -> list[NameAndTypes]:
        """Return the topics, services or actions of which a node has endpoints of a kind."""
        query = f"get_{_QUERIES[kind]}_names_and_types_by_node"
        try:
            if kind.channel is ChannelKind.ACTION:
                found = getattr(_actions(), query)(self.node, *node)
            else:
                found = getattr(self.node, query)(*node)
            return self._valid(kind.channel.value, found)
        except _REFUSED:
            return []

    def _valid(self, kind: str, found: Iterable[tuple[str, list[str]]]) -> list[NameAndTypes]:
        return [
            (name, tuple(types))
            for name, types in found
            if self._is_valid(f"{kind} '{name}'", is_valid_name, name)
        ]

    def _is_valid(self, what: str, check: Callable[..., bool], *names: str) -> bool:
        is_valid = check(*names)
        if not is_valid:
            self.skipped.add(_INVALID, what)
        return is_valid

    def _nodes_with_endpoints(self) -> list[NodeName]:
        """Return the nodes with a publisher or a subscription, as nearly all nodes have."""
        return sorted(
            {
                (info.node_name, info.node_namespace)
                for info in self._all_ends()
                if UNKNOWN_NODE not in (info.node_name, info.node_namespace)
            }
        )

    def _all_ends(self) -> Iterator[TopicEndpointInfo]:
        """Yield the publishers and subscriptions of all nodes."""
        for topic, _ in self.topics():
            yield from self.node.get_publishers_info_by_topic(topic)
            yield from self.node.get_subscriptions_info_by_topic(topic)


# A service is a pair of DDS topics: its server reads requests, its clients write them.


def servers_of(node: Node, service: str) -> list[TopicEndpointInfo]:
    """Return the endpoints that receive the requests to a service, as ``node`` discovered them."""
    return list(node.get_subscriptions_info_by_topic(f"rq{service}Request", no_mangle=True))


def clients_of(node: Node, service: str) -> list[TopicEndpointInfo]:
    """Return the endpoints that send requests to a service, as ``node`` has discovered them."""
    return list(node.get_publishers_info_by_topic(f"rq{service}Request", no_mangle=True))


def participant(endpoint: TopicEndpointInfo) -> bytes:
    """Return the prefix of the participant with an endpoint."""
    return bytes(endpoint.endpoint_gid[:PARTICIPANT_BYTES])


@lru_cache(_KNOWN_NAMES)
def is_valid_name(name: str) -> bool:
    """Return whether ``name`` is a valid full name in ROS."""
    try:
        return validate_full_topic_name(name)
    except (NameValidationException, ValueError):  # the latter for a null character
        return False


@lru_cache(_KNOWN_NAMES)
def _is_node(name: str, namespace: str) -> bool:
    try:
        return validate_node_name(name) and validate_namespace(namespace)
    except (NameValidationException, ValueError):
        return False


def _actions() -> ModuleType:
    """Import the queries of actions late: they import numpy, which most commands do not need."""
    return import_module("rclpy.action.graph")


# What rclpy lacks. rclpy has loaded librcl of the ROS installation in use.
_RCL = ctypes.CDLL("librcl.so")
_guard_condition_of = _RCL.rcl_node_get_graph_guard_condition
_guard_condition_of.argtypes = [ctypes.c_void_p]
_guard_condition_of.restype = ctypes.c_void_p
_add_guard_condition = _RCL.rcl_wait_set_add_guard_condition
_add_guard_condition.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.POINTER(ctypes.c_size_t)]
_add_guard_condition.restype = ctypes.c_int


class GraphChanges:
    """Counts the changes of the ROS graph, for rare queries of any thread.

    rcl triggers a guard condition at each change. A context can have only one of these: each call
    resets that condition.
    """

    def __init__(self, node: Node) -> None:
        #: The node whose view of the graph it is.
        self.node = node
        self._wait_set = rclpy_implementation.WaitSet(0, 1, 0, 0, 0, 0, node.context.handle)
        self._number = 0
        self._looking = threading.Lock()

    def number(self) -> int:
        """Return another number than the last time if the graph may have changed since then."""
        with self._looking, self.node.handle:
            self._wait_set.clear_entities()
            index = ctypes.c_size_t()
            condition = _guard_condition_of(self.node.handle.pointer)
            refusal = _add_guard_condition(self._wait_set.pointer, condition, ctypes.byref(index))
            self._wait_set.wait(0)
            if refusal or self._wait_set.is_ready("guard_condition", index.value):
                self._number += 1
            return self._number
