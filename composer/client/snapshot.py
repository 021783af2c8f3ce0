"""Snapshots of the whole ROS graph: nodes with endpoints, states and parameters, and rates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Self

from lifecycle_msgs.srv import GetState
from rcl_interfaces.srv import GetParameters, ListParameters

from composer.client.messages.rates import RateMeter
from composer.client.requests import ServiceCaller
from composer.client.session import Deadline, Session
from composer.client.systems.proxies import LIFECYCLE, PARAMETERS, Proxies
from composer.language.tree import Plain
from composer.model import PortKind
from composer.model.names import is_hidden
from composer.plan.drift import ObservedEndpoint, ObservedNode, Snapshot
from composer.runtime.protocol.requests import full_parameter_name
from composer.runtime.ros.parameter_values import plain_value
from composer.runtime.ros_graph.node_endpoints import endpoints, node_names, visible_topics

#: How long to wait for the responses of nodes; later ones count as unknown.
_RESPONSE_S = 2.0
_STATE_TYPE = "lifecycle_msgs/srv/GetState"
_LIST_TYPE = "rcl_interfaces/srv/ListParameters"


class GraphObserver:
    """Takes snapshots of the graph. Use it in a ``with`` block."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._caller = ServiceCaller(session)
        self._proxies = Proxies(session)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._caller.close()
        self._proxies.close()

    def snapshot(self, deadline: Deadline) -> Snapshot:
        """Return the graph once discovery is complete, or at the deadline."""
        session = self._session
        graph = session.graph
        ends = dict(session.wait_until_settled(lambda: endpoints(graph), deadline))
        counts = Counter(node_names(graph))
        services = _services(ends)
        self._proxies.discover(self._response_deadline(deadline))
        states = self._states(services, deadline) | self._proxy_states()
        parameters = self._parameters(services, deadline)
        return Snapshot(
            tuple(
                ObservedNode(
                    full_name=name,
                    endpoints=tuple(end for end in ends[name] if not end.is_for_tools),
                    state=states.get(name, ""),
                    parameters=parameters.get(name, {}),
                    count=max(counts[name], 1),
                )
                for name in sorted(ends)
            )
        )

    def parameters(
        self, ends: Mapping[str, Sequence[ObservedEndpoint]], deadline: Deadline
    ) -> dict[str, dict[str, Plain] | None]:
        """Return the parameters of nodes with these endpoints, None without a response."""
        self._proxies.discover(self._response_deadline(deadline))
        return self._parameters(_services(ends), deadline)

    def rates(self, deadline: Deadline, measure_s: float) -> dict[str, float]:
        """Return the message rate of each topic in Hz, measured for ``measure_s``.

        Topics with fewer than two messages, and topics whose type is not installed, are left out.
        The measurement ends at the deadline.
        """
        if measure_s <= 0.0:
            return {}
        with RateMeter(self._session, visible_topics(self._session.graph)) as meter:
            return meter.measure(min(measure_s, deadline.left_s))

    def _states(
        self, services: dict[str, dict[str, str]], deadline: Deadline
    ) -> dict[str, str | None]:
        nodes = _offering(services, "get_state", _STATE_TYPE)
        responses = self._caller.call_all(
            GetState,
            {name: GetState.Request() for name in nodes},
            self._response_deadline(deadline),
        )
        return {
            node: None if responses[name] is None else str(responses[name].current_state.label)
            for name, node in nodes.items()
        }

    def _proxy_states(self) -> dict[str, str | None]:
        """Return the states of nodes without services of their own, from their managers."""
        return {node: self._proxies.state(node) for node in self._proxies.nodes(LIFECYCLE)}

    def _parameters(
        self, services: dict[str, dict[str, str]], deadline: Deadline
    ) -> dict[str, dict[str, Plain] | None]:
        nodes = _offering(services, "list_parameters", _LIST_TYPE)
        listed = self._caller.call_all(
            ListParameters,
            {name: ListParameters.Request() for name in nodes},
            self._response_deadline(deadline),
        )
        names = {
            node: sorted(listed[name].result.names)
            for name, node in nodes.items()
            if listed[name] is not None
        }
        values = self._caller.call_all(
            GetParameters,
            {
                f"{node}/get_parameters": GetParameters.Request(names=listed_names)
                for node, listed_names in names.items()
            },
            self._response_deadline(deadline),
        )
        found: dict[str, dict[str, Plain] | None] = dict.fromkeys(nodes.values())
        for node, listed_names in names.items():
            response = values[f"{node}/get_parameters"]
            if response is not None and len(response.values) == len(listed_names):
                found[node] = dict(
                    zip(listed_names, map(plain_value, response.values), strict=True)
                )
        return self._from_managers(found)

    def _from_managers(
        self, found: dict[str, dict[str, Plain] | None]
    ) -> dict[str, dict[str, Plain] | None]:
        """Move the parameters that managers list for other nodes to these nodes."""
        proxied: dict[str, dict[str, Plain] | None] = {}
        for node, manager in self._proxies.nodes(PARAMETERS).items():
            values, prefix = found.get(manager), full_parameter_name(node, "")
            proxied[node] = values and {
                name.removeprefix(prefix): value
                for name, value in values.items()
                if name.startswith(prefix)
            }
        own = {
            node: values and {name: values[name] for name in values if not name.startswith("/")}
            for node, values in found.items()
        }
        return own | proxied

    def _response_deadline(self, deadline: Deadline) -> Deadline:
        return Deadline(min(_RESPONSE_S, deadline.left_s))


def _services(ends: Mapping[str, Sequence[ObservedEndpoint]]) -> dict[str, dict[str, str]]:
    """Return the services of each node that is not hidden, with their types."""
    return {
        node: {end.name: end.type for end in found if end.kind is PortKind.SERVICE}
        for node, found in ends.items()
        if not is_hidden(node)
    }


def _offering(services: dict[str, dict[str, str]], last: str, type_name: str) -> dict[str, str]:
    """Return the nodes with a service of that name and type, by the full name of the service."""
    return {
        f"{node}/{last}": node
        for node, offered in services.items()
        if offered.get(f"{node}/{last}") == type_name
    }
