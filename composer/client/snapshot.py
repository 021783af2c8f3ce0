"""Snapshots of the whole ROS graph: nodes with endpoints, states and parameters, and rates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from typing import Any, Self

from lifecycle_msgs.srv import GetState
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters

from composer.client.messages.topics import measure_rates
from composer.client.session import Deadline, Session
from composer.client.systems.node_services import NodeServices
from composer.language.tree import Plain
from composer.model.interface_packages import COMPOSITION
from composer.model.names import is_hidden
from composer.plan.drift import ObservedNode, Snapshot
from composer.runtime.protocol.requests import ParameterDescription
from composer.runtime.ros.conversions import description, plain_value
from composer.runtime.ros.endpoints import endpoints, node_names, visible_topics
from composer.runtime.ros.messages import MessageError, interface_class

#: How long to wait for the responses of nodes; later ones count as unknown.
_RESPONSE_S = 2.0
_CONTAINER, _LIST_NODES = "/_container", "/list_nodes"


class GraphObserver:
    """Takes snapshots of the graph. Use it in a ``with`` block."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._services = NodeServices(session)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._services.close()

    def snapshot(self, deadline: Deadline) -> Snapshot:
        """Return the graph once discovery is complete, or at the deadline."""
        session = self._session
        graph = session.graph
        ends = dict(session.wait_until_settled(lambda: endpoints(graph), deadline))
        counts = Counter(node_names(graph))
        asked = self._asked(ends.keys(), GetState, deadline)
        states = self._services.states(asked, deadline.at_most(_RESPONSE_S))
        parameters = self.parameters(ends.keys(), deadline)
        containers = self._containers(deadline)
        return Snapshot(
            tuple(
                ObservedNode(
                    full_name=name,
                    endpoints=tuple(end for end in ends[name] if not end.is_for_tools),
                    state=states.get(name, ""),
                    parameters=parameters.get(name, {}),
                    count=max(counts[name], 1),
                    container=containers.get(name, ""),
                )
                for name in sorted(ends)
            )
        )

    def rates(self, deadline: Deadline, measure_s: float) -> dict[str, float]:
        """Return the message rate of each topic in Hz, measured for ``measure_s``.

        Topics with fewer than two messages, and topics whose type is not installed, are left out.
        The measurement ends at the deadline.
        """
        if measure_s <= 0.0:
            return {}
        topics = visible_topics(self._session.graph)
        return measure_rates(self._session, topics, min(measure_s, deadline.left_s))

    def _containers(self, deadline: Deadline) -> dict[str, str]:
        """Return the container of each loaded component, by full names, as far as they are known.

        Without composition_interfaces, containers cannot be asked.
        """
        servers = [
            name.removesuffix(_LIST_NODES)
            for name, _ in self._session.graph.services()
            if name.endswith(_CONTAINER + _LIST_NODES)
        ]
        if not servers:
            return {}
        try:
            kind = interface_class(f"{COMPOSITION}/srv/ListNodes")
        except MessageError:
            return {}
        requests = dict.fromkeys(servers, kind.Request())
        responses = self._services.call_all(kind, requests, deadline.at_most(_RESPONSE_S))
        return {
            str(name): server.removesuffix(_CONTAINER)
            for server, response in responses.items()
            if response is not None
            for name in response.full_node_names
        }

    def parameters(
        self, nodes: Collection[str], deadline: Deadline
    ) -> dict[str, dict[str, Plain] | None]:
        """Return the parameters of the nodes that have any, None without a response."""
        asked = self._asked(nodes, ListParameters, deadline)
        lists = dict.fromkeys(asked, ListParameters.Request())
        responses = self._services.call_all(ListParameters, lists, deadline.at_most(_RESPONSE_S))
        requests = {
            node: GetParameters.Request(names=sorted(response.result.names))
            for node, response in responses.items()
            if response is not None
        }
        values = self._services.call_all(GetParameters, requests, deadline.at_most(_RESPONSE_S))
        found: dict[str, dict[str, Plain] | None] = dict.fromkeys(responses)
        for node, response in values.items():
            names = requests[node].names
            if response is not None and len(response.values) == len(names):
                found[node] = dict(zip(names, map(plain_value, response.values), strict=True))
        return found

    def parameter_settings(
        self, names: Mapping[str, Iterable[str]], deadline: Deadline
    ) -> dict[str, dict[str, dict[str, Plain]]]:
        """Return the declarations of parameters as in YAML, by node and parameter.

        ``names`` are the parameters of each node. Nodes without the service, or that do not
        respond, are left out.
        """
        requests = {
            node: DescribeParameters.Request(names=list(names[node]))
            for node in self._asked(names.keys(), DescribeParameters, deadline)
        }
        limit = deadline.at_most(_RESPONSE_S)
        responses = self._services.call_all(DescribeParameters, requests, limit)
        found: dict[str, dict[str, dict[str, Plain]]] = {}
        for node, response in responses.items():
            listed = requests[node].names
            if response is not None and len(response.descriptors) == len(listed):
                descriptions = map(description, listed, response.descriptors)
                found[node] = {item.name: _settings_of(item) for item in descriptions}
        return found

    def _asked(self, nodes: Collection[str], kind: Any, deadline: Deadline) -> list[str]:
        """Return the nodes that have a service."""
        offering = self._services.nodes(kind, deadline.at_most(_RESPONSE_S))
        return [node for node in nodes if node in offering and not is_hidden(node)]


def _settings_of(item: ParameterDescription) -> dict[str, Plain]:
    """Return the declaration of a parameter as in YAML, without its value."""
    settings: dict[str, Plain] = {
        "minimum": item.minimum,
        "maximum": item.maximum,
        "step": item.step,
        "read_only": item.read_only or None,
        "description": item.description or None,
    }
    if "unknown" not in item.type and item.type != "not set":
        settings["type"] = item.type
    return {key: value for key, value in settings.items() if value is not None}
