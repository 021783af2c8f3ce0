"""Names in the ROS graph: nodes, topics, services and actions, and the nodes that use them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from composer.client.name_matching import find_node, full_name, not_found_error
from composer.client.session import Deadline, RosError, Session
from composer.model.names import is_hidden
from composer.runtime.protocol.requests import (
    ActionInfo,
    NameAndTypes,
    NodeInfo,
    visible_names,
)
from composer.runtime.ros_graph.node_endpoints import action_info, node_info

T = TypeVar("T")


class GraphNames:
    """Looks up names in the ROS graph, all within one time limit."""

    def __init__(self, session: Session, deadline: Deadline) -> None:
        self._session = session
        self._deadline = deadline
        self._graph = session.graph

    def names(self, kind: str, *, hidden: bool = False) -> tuple[NameAndTypes, ...]:
        """Return all nodes, topics, services or actions, sorted, with their types.

        Nodes have no types. A name that two nodes share is listed twice.
        """
        found = self._settled(lambda: self._graph.names(kind))
        if kind == "topic" and not self._session.others():
            return ()  # they are those of this session
        return found if hidden else visible_names(found)

    def node(self, name: str, *, hidden: bool = False) -> NodeInfo:
        """Return the endpoints of a node. Raises NotFoundError."""
        full_name = self.find_node(name)
        return self._settled(lambda: node_info(self._graph, full_name, hidden=hidden))

    def action(self, name: str) -> ActionInfo:
        """Return the servers and clients of an action. Raises NotFoundError."""
        types = self.types("action", name)
        absolute = full_name("action", name)
        return self._settled(lambda: action_info(self._graph, absolute, types))

    def find_node(self, name: str) -> str:
        """Return the full name of the node that ``name`` refers to. Raises NotFoundError."""
        return find_node(self._session, self._deadline, name, self._nodes)

    def types(self, kind: str, name: str) -> tuple[str, ...]:
        """Return the types of a topic, service or action, once it is discovered.

        A name without a leading slash is in the root namespace. Raises NotFoundError.
        """
        absolute = full_name(kind, name)

        def known() -> dict[str, tuple[str, ...]]:
            return dict(self._graph.names(kind))

        types = self._session.search(lambda: known().get(absolute), self._deadline)
        if types is None:
            raise not_found_error(kind, absolute, [item for item in known() if not is_hidden(item)])
        return types

    def only_type(self, kind: str, name: str) -> str:
        """Return the type of a topic, service or action.

        Raises NotFoundError; RosError if there is more than one type.
        """
        types = self.types(kind, name)
        if len(types) > 1:
            raise RosError(
                f"{kind} '{name}' has more than one type", f"specify one of: {', '.join(types)}"
            )
        return types[0]

    def _settled(self, poll: Callable[[], T]) -> T:
        return self._session.wait_until_settled(poll, self._deadline)

    def _nodes(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self._graph.names("node"))


def type_mismatch_hint(session: Session, kind: str, name: str, type_name: str) -> str | None:
    """Return a hint if other nodes use ``name`` with another type, else None."""
    known = dict(session.graph.names(kind)).get(name, ())
    others = [other for other in known if other != type_name]
    return f"other nodes use type {', '.join(others)}, not {type_name}" if others else None
