"""The endpoints of topics and of nodes in the ROS graph, and the servers and clients of actions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import Any, TypeAlias

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from composer.base.fast_dataclass import dataclass
from composer.model import ChannelKind, PortKind
from composer.model.names import is_hidden, join_node_name, split_node_name
from composer.model.qos import QosProfile
from composer.plan.drift import ObservedEndpoint
from composer.runtime.ros.conversions import discovered_profile
from composer.runtime.ros.graph import PARTICIPANT_BYTES, UNKNOWN_NODE, NodeName, RosGraph

#: The order of endpoints of a node.
_ORDER = {kind: number for number, kind in enumerate(PortKind)}
_Ends: TypeAlias = dict[str, list[ObservedEndpoint]]


@dataclass(frozen=True, slots=True)
class EndpointInfo:
    """A publisher or a subscription of a node. ``gid`` and ``type_hash`` are spelled as in ros2.

    Endpoints that differ only in these two are equal.
    """

    node: str
    type: str
    qos: QosProfile
    gid: str = field(default="", compare=False)
    type_hash: str = field(default="", compare=False)

    @property
    def is_nameless(self) -> bool:
        """Whether the endpoint is discovered but its node is not."""
        return UNKNOWN_NODE in self.node

    @property
    def participant(self) -> bytes:
        """The prefix of the participant with the endpoint."""
        return bytes.fromhex(self.gid.replace(".", ""))[:PARTICIPANT_BYTES]

    @property
    def name(self) -> str:
        """The node's name, for messages."""
        return "a node whose name is unknown" if self.is_nameless else self.node

    def plain(self) -> dict[str, Any]:
        """Return the endpoint as data for JSON."""
        return {
            "node": self.node,
            "type": self.type,
            "type_hash": self.type_hash,
            "gid": self.gid,
            "qos": _announced(self.qos),
        }


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic and its endpoints."""

    name: str
    types: tuple[str, ...]
    publishers: tuple[EndpointInfo, ...]
    subscriptions: tuple[EndpointInfo, ...]

    def plain(self) -> dict[str, Any]:
        """Return the topic and its endpoints as data for JSON."""
        return {
            "name": self.name,
            "types": list(self.types),
            "publishers": [item.plain() for item in self.publishers],
            "subscriptions": [item.plain() for item in self.subscriptions],
        }


def topic_info(node: Node, name: str, types: tuple[str, ...]) -> TopicInfo:
    """Return the endpoints of a topic, by its full name, that are discovered now."""
    return TopicInfo(
        name,
        types,
        _endpoints(node.get_publishers_info_by_topic(name)),
        _endpoints(node.get_subscriptions_info_by_topic(name)),
    )


def _announced(profile: QosProfile) -> dict[str, Any]:
    """Return the policies that are announced to other processes, without unset durations."""
    policies: dict[str, Any] = {
        "reliability": profile.reliability.value,
        "durability": profile.durability.value,
        "liveliness": profile.liveliness.value,
    }
    for name in ("deadline_ms", "lifespan_ms", "liveliness_lease_duration_ms"):
        value = getattr(profile, name)
        if value is not None:
            policies[name] = value
    return policies


def _endpoints(infos: list[TopicEndpointInfo]) -> tuple[EndpointInfo, ...]:
    return tuple(sorted(map(_endpoint, infos), key=lambda item: (item.node, item.type)))


def _endpoint(info: TopicEndpointInfo) -> EndpointInfo:
    node = join_node_name(info.node_namespace, info.node_name)
    return EndpointInfo(
        node,
        info.topic_type,
        discovered_profile(info.qos_profile),
        gid=".".join(f"{byte:02x}" for byte in info.endpoint_gid),
        type_hash=str(info.topic_type_hash),
    )


def details(graph: RosGraph, kind: str, name: str, types: tuple[str, ...]) -> dict[str, Any]:
    """Return a node, topic or action, by its full name, with its endpoints, as plain data.

    The endpoints of a node have their types, and hidden ones are included.
    """
    if kind == "topic":
        return topic_info(graph.node, name, types).plain()
    if kind == "node":
        return {"name": name} | {
            each.section: sorted(graph.ends_of(_split(name), each)) for each in PortKind
        }
    ends = {
        each: [
            node
            for node, _ in graph.names("node")
            for action, _ in graph.ends_of(_split(node), each)
            if action == name
        ]
        for each in (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT)
    }
    servers, clients = ends.values()
    return {"name": name, "types": list(types), "servers": servers, "clients": clients}


def _split(full_name: str) -> NodeName:
    namespace, name = split_node_name(full_name)
    return name, namespace


def endpoints(graph: RosGraph) -> tuple[tuple[str, tuple[ObservedEndpoint, ...]], ...]:
    """Return the nodes discovered so far with their endpoints, as a hashable value."""
    ends = _endpoints_by_node(graph)
    return tuple((name, tuple(ends[name])) for name in sorted(ends))


def _endpoints_by_node(graph: RosGraph) -> _Ends:
    nodes, replaced = graph.nodes_and_replaced()
    ends: _Ends = {join_node_name(namespace, name): [] for name, namespace in nodes}
    for topic, types in visible_topics(graph).items():
        info = topic_info(graph.node, topic, types)
        for kind, found in (
            (PortKind.PUBLISHER, info.publishers),
            (PortKind.SUBSCRIPTION, info.subscriptions),
        ):
            for end in found:
                if end.node in ends and end.participant not in replaced:
                    ends[end.node].append(ObservedEndpoint(kind, topic, end.type, end.qos))
    for name, of_node in ends.items():
        of_node.extend(_services_and_actions(graph, name))
        of_node.sort(key=lambda end: (_ORDER[end.kind], end.name, end.type))
    return ends


def _services_and_actions(graph: RosGraph, full_name: str) -> Iterator[ObservedEndpoint]:
    for kind in PortKind:
        if kind.channel is ChannelKind.TOPIC:
            continue
        for found, types in graph.ends_of(_split(full_name), kind):
            if not is_hidden(found):
                yield from (ObservedEndpoint(kind, found, type_name) for type_name in types)


def node_names(graph: RosGraph) -> list[str]:
    """Return the full names of all nodes; a name that two nodes share is listed twice."""
    return [join_node_name(namespace, name) for name, namespace in graph.nodes()]


def visible_topics(graph: RosGraph) -> dict[str, tuple[str, ...]]:
    """Return the types of each topic that ROS tools do not hide."""
    return {name: types for name, types in sorted(graph.topics()) if not is_hidden(name)}
