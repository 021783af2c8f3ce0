"""The endpoints of a node in the ROS graph."""

from __future__ import annotations

from collections.abc import Iterable

from composer.fast_dataclass import dataclass
from composer.names import split_node_name
from composer.runtime.process.query_socket import NameAndTypes, visible
from composer.runtime.ros_graph.graph import RosGraph


@dataclass(frozen=True, slots=True)
class NodeInfo:
    """The endpoints of a node, by name."""

    name: str
    subscriptions: tuple[NameAndTypes, ...]
    publishers: tuple[NameAndTypes, ...]
    services: tuple[NameAndTypes, ...]
    clients: tuple[NameAndTypes, ...]
    action_servers: tuple[NameAndTypes, ...]
    action_clients: tuple[NameAndTypes, ...]


def node_info(graph: RosGraph, full_name: str, *, hidden: bool) -> NodeInfo:
    """Return the endpoints of a node; those of ROS itself only if ``hidden``."""
    namespace, name = split_node_name(full_name)
    queries = (
        graph.subscriptions_of,
        graph.publishers_of,
        graph.services_of,
        graph.clients_of,
        graph.action_servers_of,
        graph.action_clients_of,
    )
    return NodeInfo(full_name, *(_sorted(query((name, namespace)), hidden) for query in queries))


def _sorted(found: Iterable[NameAndTypes], hidden: bool) -> tuple[NameAndTypes, ...]:
    return tuple(sorted(found if hidden else visible(found)))
