"""What is in the ROS graph: nodes, topics, services, actions and who offers and uses them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)
from rclpy.node import Node

from composer.remote.name_matching import find_node, full_name, not_there
from composer.remote.session import Deadline, Session

T = TypeVar("T")

#: (name, types): more than one type means that somebody has it wrong.
Named = tuple[str, tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class NodeInfo:
    """What one node offers and uses, each by name."""

    name: str
    subscriptions: tuple[Named, ...]
    publishers: tuple[Named, ...]
    services: tuple[Named, ...]
    clients: tuple[Named, ...]
    action_servers: tuple[Named, ...]
    action_clients: tuple[Named, ...]


@dataclass(frozen=True, slots=True)
class ActionInfo:
    """Who serves an action and who uses it."""

    name: str
    types: tuple[str, ...]
    servers: tuple[str, ...]
    clients: tuple[str, ...]


def is_hidden(name: str) -> bool:
    """Say whether a part of the name begins with an underscore.

    See 'hidden' in the ROS 2 design article 'Topic and Service name mapping'.
    """
    return any(part.startswith("_") for part in name.split("/"))


class Names:
    """Looks names up in the graph, all within one time limit."""

    def __init__(self, session: Session, deadline: Deadline) -> None:
        self._session = session
        self._deadline = deadline
        self._node: Node = session.node

    def nodes(self, *, hidden: bool = False) -> tuple[str, ...]:
        """Return the full names of all nodes; one that is there twice comes twice."""
        return self._still(lambda: self._nodes(hidden))

    def topics(self, *, hidden: bool = False) -> tuple[Named, ...]:
        """Return all topics and their types."""
        found = self._still(lambda: _named(self._node.get_topic_names_and_types(), hidden))
        return found if self._session.others() else ()  # the command's own are not worth telling

    def services(self, *, hidden: bool = False) -> tuple[Named, ...]:
        """Return all services and their types."""
        return self._still(lambda: _named(self._node.get_service_names_and_types(), hidden))

    def actions(self) -> tuple[Named, ...]:
        """Return all actions and their types."""
        return self._still(lambda: _named(get_action_names_and_types(self._node), hidden=False))

    def node(self, name: str, *, hidden: bool = False) -> NodeInfo:
        """Return what a node offers and uses. Raises NotThere."""
        full_name = self.find_node(name)
        return self._still(lambda: self._node_info(full_name, hidden))

    def action(self, name: str) -> ActionInfo:
        """Return who serves and uses an action. Raises NotThere."""
        types = self.types("action", name)
        return self._still(lambda: self._action_info(full_name("action", name), types))

    def find_node(self, name: str) -> str:
        """Return the full name of the node that ``name`` means. Raises NotThere."""
        return find_node(self._session, self._deadline, name, lambda: self._nodes(hidden=True))

    def types(self, kind: str, name: str) -> tuple[str, ...]:
        """Return the types of a topic, service or action. Raises NotThere."""
        node = self._node
        wanted = self.find(kind, name, lambda: tuple(found for found, _ in _look(node, kind)))
        return dict(_named(_look(node, kind), hidden=True))[wanted]

    def find(self, kind: str, name: str, look: Callable[[], tuple[str, ...]]) -> str:
        """Wait until ``name`` is among what ``look`` finds, and return it. Raises NotThere.

        A name without a leading slash means the one in the root namespace.
        """
        wanted = full_name(kind, name)
        if self._session.search(lambda: wanted in look() or None, self._deadline):
            return wanted
        known = [found for found in look() if not is_hidden(found)]
        raise not_there(kind, wanted, known)

    def _still(self, look: Callable[[], T]) -> T:
        return self._session.wait_until_still(look, self._deadline)

    def _nodes(self, hidden: bool) -> tuple[str, ...]:
        names = (f"{namespace.rstrip('/')}/{name}" for name, namespace in self._session.others())
        return tuple(sorted(name for name in names if hidden or not is_hidden(name)))

    def _node_info(self, full_name: str, hidden: bool) -> NodeInfo:
        namespace, _, name = full_name.rpartition("/")
        where = (name, namespace or "/")

        def named(look: Callable[..., Iterable[Any]]) -> tuple[Named, ...]:
            return _named(look(*where), hidden)

        node = self._node
        return NodeInfo(
            full_name,
            named(node.get_subscriber_names_and_types_by_node),
            named(node.get_publisher_names_and_types_by_node),
            named(node.get_service_names_and_types_by_node),
            named(node.get_client_names_and_types_by_node),
            named(lambda *at: get_action_server_names_and_types_by_node(node, *at)),
            named(lambda *at: get_action_client_names_and_types_by_node(node, *at)),
        )

    def _action_info(self, name: str, types: tuple[str, ...]) -> ActionInfo:
        servers, clients = [], []
        for node in self._nodes(hidden=True):
            info = self._node_info(node, hidden=True)
            servers += [node for found, _ in info.action_servers if found == name]
            clients += [node for found, _ in info.action_clients if found == name]
        return ActionInfo(name, types, tuple(servers), tuple(clients))


def other_types(session: Session, kind: str, name: str, type_name: str) -> str | None:
    """Return a hint where somebody knows ``name`` by another type, which explains a silence."""
    known = dict(_named(_look(session.node, kind), hidden=True)).get(name, ())
    others = [other for other in known if other != type_name]
    return f"here it is of type {', '.join(others)}, not {type_name}" if others else None


def _look(node: Node, kind: str) -> Iterable[tuple[str, list[str]]]:
    match kind:
        case "topic":
            return node.get_topic_names_and_types()
        case "service":
            return node.get_service_names_and_types()
        case _:
            return get_action_names_and_types(node)


def _named(found: Iterable[tuple[str, list[str]]], hidden: bool) -> tuple[Named, ...]:
    return tuple(
        sorted((name, tuple(types)) for name, types in found if hidden or not is_hidden(name))
    )
