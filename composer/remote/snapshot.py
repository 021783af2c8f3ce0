"""Looks at a whole ROS graph: every node with its endpoints, state and parameters, and rates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Self, TypeAlias

from lifecycle_msgs.srv import GetState
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.node import Node

from composer.drift import EndSeen, NodeSeen, Snapshot
from composer.model import PortKind
from composer.remote.graph_names import is_hidden
from composer.remote.parameters import plain_value
from composer.remote.proxies import LIFECYCLE, PARAMETERS, Deputies
from composer.remote.rate_sampling import RateMeter
from composer.remote.requests import Asker
from composer.remote.session import Deadline, Session
from composer.runtime.ros.endpoints import topic_info
from composer.runtime.ros.manager_protocol import full_parameter_name
from composer.tree import Plain

#: Who has not answered by then is busy or gone; what it did not say is said to be unknown.
_PATIENCE_S = 2.0
_STATE_TYPE = "lifecycle_msgs/srv/GetState"
_LIST_TYPE = "rcl_interfaces/srv/ListParameters"

_Ends: TypeAlias = dict[str, list[EndSeen]]
_Where: TypeAlias = tuple[str, str]


class Observer:
    """Takes snapshots, again and again if need be. Use it in a ``with`` block."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._asker = Asker(session)
        self._deputies = Deputies(session)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._asker.close()
        self._deputies.close()

    def look(self, deadline: Deadline) -> Snapshot:
        """Return what is there, once all is discovered or the deadline is there."""
        session = self._session
        ends = dict(session.wait_until_still(lambda: _frozen(session.node), deadline))
        counts = Counter(_names(session.node))
        services = {
            node: {end.name: end.type for end in found if end.kind is PortKind.SERVICE}
            for node, found in ends.items()
            if not is_hidden(node)
        }
        self._deputies.meet(self._patience(deadline))
        states = self._states(services, deadline) | self._told_states()
        parameters = self._parameters(services, deadline)
        return Snapshot(
            tuple(
                NodeSeen(
                    full_name=name,
                    ends=tuple(end for end in ends[name] if not end.is_for_tools),
                    state=states.get(name, ""),
                    parameters=parameters.get(name, {}),
                    count=max(counts[name], 1),
                )
                for name in sorted(ends)
            )
        )

    def rates(self, deadline: Deadline, measure_s: float) -> dict[str, float]:
        """Return how often messages come over each topic in Hz, counted for ``measure_s``.

        Topics with less than two messages in that time, and those whose type is not installed
        here, are left out. Nothing is counted beyond the deadline.
        """
        if measure_s <= 0.0:
            return {}
        node = self._session.node
        with RateMeter(node, _topics(node)) as meter:
            return meter.measure(min(measure_s, deadline.left_s))

    def _states(
        self, services: dict[str, dict[str, str]], deadline: Deadline
    ) -> dict[str, str | None]:
        asked = _offering(services, "get_state", _STATE_TYPE)
        answers = self._asker.ask(
            GetState, {name: GetState.Request() for name in asked}, self._patience(deadline)
        )
        return {
            node: None if answers[name] is None else str(answers[name].current_state.label)
            for name, node in asked.items()
        }

    def _told_states(self) -> dict[str, str | None]:
        """Return the states of nodes without services of their own, as managers tell them."""
        return {node: self._deputies.state(node) for node in self._deputies.nodes(LIFECYCLE)}

    def _parameters(
        self, services: dict[str, dict[str, str]], deadline: Deadline
    ) -> dict[str, dict[str, Plain] | None]:
        asked = _offering(services, "list_parameters", _LIST_TYPE)
        listed = self._asker.ask(
            ListParameters,
            {name: ListParameters.Request() for name in asked},
            self._patience(deadline),
        )
        names = {
            node: sorted(listed[name].result.names)
            for name, node in asked.items()
            if listed[name] is not None
        }
        values = self._asker.ask(
            GetParameters,
            {
                f"{node}/get_parameters": GetParameters.Request(names=wanted)
                for node, wanted in names.items()
            },
            self._patience(deadline),
        )
        found: dict[str, dict[str, Plain] | None] = dict.fromkeys(asked.values())
        for node, wanted in names.items():
            answer = values[f"{node}/get_parameters"]
            if answer is not None and len(answer.values) == len(wanted):
                found[node] = dict(zip(wanted, map(plain_value, answer.values), strict=True))
        return self._handed_out(found)

    def _handed_out(
        self, found: dict[str, dict[str, Plain] | None]
    ) -> dict[str, dict[str, Plain] | None]:
        """Return the parameters with those that managers answer for at their nodes."""
        left = self._deputies.nodes(PARAMETERS)
        managers = {manager: found.pop(manager, None) for manager in set(left.values())}
        for node, manager in left.items():
            told, owned = managers[manager], full_parameter_name(node, "")
            found[node] = told and {
                name.removeprefix(owned): value
                for name, value in told.items()
                if name.startswith(owned)
            }
        return found

    def _patience(self, deadline: Deadline) -> Deadline:
        return Deadline(min(_PATIENCE_S, deadline.left_s))


def _offering(services: dict[str, dict[str, str]], last: str, type_name: str) -> dict[str, str]:
    """Return the nodes that have a service of that name and type, by the service's full name."""
    return {
        f"{node}/{last}": node
        for node, offered in services.items()
        if offered.get(f"{node}/{last}") == type_name
    }


def _frozen(node: Node) -> tuple[tuple[str, tuple[EndSeen, ...]], ...]:
    """Return the endpoints of all nodes in a form that can be compared."""
    ends = _ends_by_node(node)
    return tuple((name, tuple(ends[name])) for name in sorted(ends))


def _ends_by_node(node: Node) -> _Ends:
    ends: _Ends = {name: [] for name in _names(node)}
    for topic, types in _topics(node).items():
        info = topic_info(node, topic, types)
        for kind, found in (
            (PortKind.PUBLISHER, info.publishers),
            (PortKind.SUBSCRIPTION, info.subscriptions),
        ):
            for end in found:
                if end.node in ends:
                    ends[end.node].append(EndSeen(kind, topic, end.type, end.qos))
    for name, of_node in ends.items():
        of_node.extend(_others(node, name))
        of_node.sort(key=lambda end: (list(PortKind).index(end.kind), end.name, end.type))
    return ends


def _others(node: Node, full_name: str) -> Iterator[EndSeen]:
    namespace, _, name = full_name.rpartition("/")
    where = (name, namespace or "/")
    readers: tuple[tuple[PortKind, Callable[[_Where], Iterable[Any]]], ...] = (
        (PortKind.SERVICE, lambda at: node.get_service_names_and_types_by_node(*at)),
        (PortKind.CLIENT, lambda at: node.get_client_names_and_types_by_node(*at)),
        (PortKind.ACTION_SERVER, lambda at: get_action_server_names_and_types_by_node(node, *at)),
        (PortKind.ACTION_CLIENT, lambda at: get_action_client_names_and_types_by_node(node, *at)),
    )
    for kind, read in readers:
        for found, types in _read(read, where):
            if not is_hidden(found):
                yield from (EndSeen(kind, found, type_name) for type_name in types)


def _read(read: Callable[[_Where], Iterable[Any]], where: _Where) -> Iterable[Any]:
    """Return what a node has; nothing when it has left in the meantime."""
    try:
        return read(where)
    except RuntimeError:  # NodeNameNonExistentError is one
        return ()


def _names(node: Node) -> list[str]:
    return [
        f"{namespace.rstrip('/')}/{name}"
        for name, namespace in node.get_node_names_and_namespaces()
    ]


def _topics(node: Node) -> dict[str, tuple[str, ...]]:
    return {
        name: tuple(types)
        for name, types in sorted(node.get_topic_names_and_types())
        if not is_hidden(name)
    }
