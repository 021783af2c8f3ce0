"""Names in the ROS graph: nodes, topics, services and actions, and the nodes that use them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_full_topic_name import validate_full_topic_name

from composer.base.diagnostics import nearest_full_name
from composer.client.session import Deadline, NoResponseError, RosError, Session
from composer.model.names import is_hidden, is_selected, topic_name_problem
from composer.runtime.protocol.requests import NameAndTypes, visible_names
from composer.runtime.ros.endpoints import details

T = TypeVar("T")
_MAX_LISTED = 8


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
        if kind == "topic" and not self._session.graph.others():
            return ()  # they belong to this session
        return found if hidden else visible_names(found)

    def details(self, kind: str, name: str) -> dict[str, Any]:
        """Return a node, topic or action with its endpoints, as plain data.

        Raises NotFoundError.
        """
        types = () if kind == "node" else self.types(kind, name)
        found = self.find_node(name) if kind == "node" else full_name(kind, name)
        return self._settled(lambda: details(self._graph, kind, found, types))

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


class NotFoundError(RosError):
    """The name is not in the ROS graph, or is ambiguous; the hint has similar names."""


class InvalidNameError(RosError):
    """The name is not valid for a topic, service or action."""


def full_name(kind: str, name: str) -> str:
    """Return the full name; a name without a leading slash is in the root namespace.

    Raises InvalidNameError.
    """
    absolute = name if name.startswith("/") else f"/{name}"
    try:
        validate_full_topic_name(absolute)
    except InvalidTopicNameException as error:
        problem = topic_name_problem(absolute) or "is not valid"
        raise InvalidNameError(f"{kind} name '{absolute}' {problem}") from error
    return absolute


def find_node(
    session: Session,
    deadline: Deadline,
    name: str,
    list_nodes: Callable[[], tuple[str, ...]],
    kind: str = "node",
) -> str:
    """Return the full name of the node that ``name`` refers to, once it is discovered.

    ``name`` is a full name, or the last part or parts of a single node's name. Raises
    NotFoundError; NoResponseError if the node may be in a system that does not respond.
    """
    found = session.search(lambda: _matches(name, list_nodes()), deadline)
    if not found:
        check_all_respond(session)
        known = list_nodes()  # it may have been discovered meanwhile
        found = _matches(name, known)
        if not found:
            raise not_found_error(kind, name, known)
    if name not in found:  # wait for other nodes with the same last part
        found = _matches(name, session.wait_until_settled(list_nodes, deadline))
    return only_match(kind, name, found)


def only_match(kind: str, name: str, found: Sequence[str]) -> str:
    """Return the only name that ``name`` refers to. Raises NotFoundError if there are several."""
    if len(found) > 1:
        raise NotFoundError(
            f"'{name}' matches more than one {kind}", f"use a full name: {', '.join(found)}"
        )
    return found[0]


def check_all_respond(session: Session) -> None:
    """Raise NoResponseError if a system of this computer is missing in the ROS graph."""
    for name, pid in session.unresponsive_systems().items():
        raise NoResponseError(
            f"system '{name}' does not respond, so its nodes are not known",
            f"its process {pid} may be busy or stopped",
        )


def not_found_error(kind: str, name: str, known: Iterable[str]) -> NotFoundError:
    """Return the error for an unknown name, with the most similar known one."""
    return NotFoundError(f"there is no {kind} '{name}'", _hint(kind, name, list(known)))


def _matches(name: str, known: tuple[str, ...]) -> tuple[str, ...]:
    """Return the node with that full name, else those whose last parts it is."""
    return (name,) if name in known else tuple(node for node in known if is_selected(node, name))


def _hint(kind: str, name: str, known: list[str]) -> str:
    if not known:
        return (
            f"no {kind} was found: check that the system is running, and that ROS_DOMAIN_ID and"
            " the discovery range are the same"
        )
    close = nearest_full_name(name, known)
    if close is not None:
        return f"did you mean '{close}'?"
    more = ", ..." if len(known) > _MAX_LISTED else ""
    return "available: " + ", ".join(known[:_MAX_LISTED]) + more
