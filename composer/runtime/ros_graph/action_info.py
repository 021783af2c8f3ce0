"""The servers and clients of an action, as the ROS graph reports them."""

from __future__ import annotations

from composer.fast_dataclass import dataclass
from composer.names import split_node_name
from composer.runtime.ros_graph.graph import RosGraph


@dataclass(frozen=True, slots=True)
class ActionInfo:
    """The nodes with a server or client of an action."""

    name: str
    types: tuple[str, ...]
    servers: tuple[str, ...]
    clients: tuple[str, ...]


def action_info(graph: RosGraph, name: str, types: tuple[str, ...]) -> ActionInfo:
    """Return the nodes of an action, by its full name, that are discovered now."""
    servers, clients = [], []
    for node, _ in graph.names("node"):
        namespace, base_name = split_node_name(node)
        where = (base_name, namespace)
        servers += [node for found, _ in graph.action_servers_of(where) if found == name]
        clients += [node for found, _ in graph.action_clients_of(where) if found == name]
    return ActionInfo(name, types, tuple(servers), tuple(clients))
