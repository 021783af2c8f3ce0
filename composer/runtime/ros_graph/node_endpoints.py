"""The endpoints of nodes in the ROS graph, and the servers and clients of actions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

from composer.model import ChannelKind, PortKind
from composer.model.names import is_hidden, join_node_name, split_node_name
from composer.plan.drift import ObservedEndpoint
from composer.runtime.ros_graph.graph import NodeName, RosGraph


def details(graph: RosGraph, kind: str, name: str, types: tuple[str, ...]) -> dict[str, Any]:
    """Return a node, topic or action, by its full name, with its endpoints, as plain data.

    The endpoints of a node have their types, and hidden ones are included.
    """
    if kind == "topic":
        return graph.topic(name, types).plain()
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


#: The order of endpoints of a node.
_ORDER = {kind: number for number, kind in enumerate(PortKind)}

_Ends: TypeAlias = dict[str, list[ObservedEndpoint]]


def endpoints(graph: RosGraph) -> tuple[tuple[str, tuple[ObservedEndpoint, ...]], ...]:
    """Return the nodes discovered so far with their endpoints, as a hashable value."""
    ends = _endpoints_by_node(graph)
    return tuple((name, tuple(ends[name])) for name in sorted(ends))


def _endpoints_by_node(graph: RosGraph) -> _Ends:
    nodes, replaced = graph.nodes_and_replaced()
    ends: _Ends = {join_node_name(namespace, name): [] for name, namespace in nodes}
    for topic, types in visible_topics(graph).items():
        info = graph.topic(topic, types)
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
