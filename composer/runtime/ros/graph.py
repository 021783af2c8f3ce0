"""The ROS graph as a node has discovered it: participants, and the names of everything in it."""

from __future__ import annotations

from collections.abc import Iterable

from rclpy.action.graph import get_action_names_and_types
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from composer.runtime.process.graph_socket import NameAndTypes
from composer.runtime.ros.endpoints import UNKNOWN_NODE

#: The nodes of commands, which are left out of listings.
COMMAND_PREFIX = "_compose_"
#: The endpoints of a participant arrive 0.1 to 0.2 s after the participant itself; lost
#: announcements are repeated 0.11 s later. Fast DDS 2 defines these times in EDPUtils.hpp.
SETTLE_S = 0.15
#: The topic with which each ROS 2 participant announces its nodes, by its DDS name.
_PARTICIPANTS_TOPIC = "ros_discovery_info"
#: The length of the participant's prefix in the id of an endpoint (DDSI-RTPS, 9.3.1).
_PARTICIPANT_BYTES = 12


def participants(node: Node) -> frozenset[bytes]:
    """Return the prefixes of all discovered participants, including that of ``node``.

    Publishers and subscriptions are announced separately; a participant counts with both.
    """
    publishers = node.get_publishers_info_by_topic(_PARTICIPANTS_TOPIC, no_mangle=True)
    subscriptions = node.get_subscriptions_info_by_topic(_PARTICIPANTS_TOPIC, no_mangle=True)
    return frozenset(map(participant, publishers)) & frozenset(map(participant, subscriptions))


def participant(endpoint: TopicEndpointInfo) -> bytes:
    """Return the prefix of the participant with an endpoint."""
    return bytes(endpoint.endpoint_gid[:_PARTICIPANT_BYTES])


def are_nodes_known(node: Node) -> bool:
    """Say whether each participant has announced its nodes, which it does last."""
    known = node.get_publishers_info_by_topic(_PARTICIPANTS_TOPIC, no_mangle=True)
    publishers = [
        endpoint
        for topic, _ in node.get_topic_names_and_types()
        for endpoint in node.get_publishers_info_by_topic(topic)
    ]
    named = [endpoint for endpoint in publishers if endpoint.node_name != UNKNOWN_NODE]
    announced = {participant(endpoint) for endpoint in named}
    return len(named) == len(publishers) and announced.issuperset(map(participant, known))


def other_nodes(node: Node) -> tuple[tuple[str, str], ...]:
    """Return name and namespace of every known node except those of commands."""
    return tuple(
        sorted(
            (name, namespace)
            for name, namespace in node.get_node_names_and_namespaces()
            if not name.startswith(COMMAND_PREFIX)
        )
    )


def names_and_types(node: Node, kind: str) -> tuple[NameAndTypes, ...]:
    """Return the names of all nodes, topics, services or actions, sorted, with their types.

    A name that two nodes share is listed twice.
    """
    found: Iterable[tuple[str, Iterable[str]]]
    match kind:
        case "node":
            found = ((f"{space.rstrip('/')}/{name}", ()) for name, space in other_nodes(node))
        case "topic":
            found = node.get_topic_names_and_types()
        case "service":
            found = node.get_service_names_and_types()
        case _:
            found = get_action_names_and_types(node)
    return tuple(sorted((name, tuple(types)) for name, types in found))
