"""The lifecycle and parameter services of nodes, whether a node has them or its manager.

A node whose ``introspection`` disables them leaves them to the manager of its system. Requests to
them are sent to the manager, those to many nodes of a system as one: see
:mod:`composer.runtime.manager.member_service`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any, Self

from lifecycle_msgs.srv import GetState

from composer.client.requests import ServiceCaller, required, type_of
from composer.client.session import Deadline, Session
from composer.client.systems.local_queries import nodes_with
from composer.client.systems.managers import REPORT_WITHIN_S, Systems
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.protocol.codec import ProtocolError
from composer.runtime.protocol.reports import SystemReport
from composer.runtime.protocol.requests import NAME, REQUEST, CallNodes, NodeCall
from composer.runtime.ros.graph import is_valid_name
from composer.runtime.ros.messages import MessageError, convert_message, to_plain
from composer.runtime.ros.service_requests import RequestService, read_answer, request_message

#: The services that nodes may leave to their manager, by the names in its report.
_SERVICES = {
    "lifecycle": ("get_state", "get_available_transitions", "change_state"),
    "parameters": (
        *("list_parameters", "get_parameters", "get_parameter_types", "describe_parameters"),
        *("set_parameters", "set_parameters_atomically"),
    ),
}


class NodeServices:
    """Calls services of nodes. Clients and subscriptions are kept until :meth:`close`.

    The class of a service, such as ``GetState``, says its name: ``<node>/get_state``.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._caller = ServiceCaller(session)
        self._systems = Systems(session, Deadline(0.0))
        self._awaited: set[str] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Destroy the clients and subscriptions."""
        self._caller.close()
        self._systems.close()

    def has(self, node: str, kind: Any, deadline: Deadline) -> bool:
        """Return whether a node has a service, discovered so far."""
        name = f"{node}/{_name(kind)}"
        is_own = any(name == known for known, _ in self._session.graph.services())
        return is_own or node in self.nodes(kind, deadline)

    def nodes(self, kind: Any, deadline: Deadline) -> set[str]:
        """Return the nodes with a service, discovered so far.

        The first report of each manager is waited for.
        """
        self._wait_for_reports(deadline)
        service = _name(kind)
        own = nodes_with(self._session.graph.services(), f"/{service}", type_of(kind))
        return own | {node for node, _ in self._left(service)}

    def call(
        self, kind: Any, node: str, request: Any, deadline: Deadline, *, once: bool = False
    ) -> Any:
        """Return the response of a service of a node. Raises NoResponseError.

        A request that changes nothing is sent again every second, others are sent ``once``.
        """
        name = f"{node}/{_name(kind)}"
        system = self._systems_of_nodes(kind).get(node)
        if not once:
            response = self.call_all(kind, {node: request}, deadline)[node]
        elif system is None:
            response = self._caller.call_once(kind, name, request, deadline)
        else:
            document, service = _document({name: request}), _service(system)
            message = request_message(document)
            answer = self._caller.call_once(RequestService, service, message, deadline)
            response = dict(_responses(kind, document, answer)).get(node)
        return required({name: response}, deadline)

    def call_all(
        self, kind: Any, requests: Mapping[str, Any], deadline: Deadline
    ) -> dict[str, Any]:
        """Return the response of each node, None for those that did not respond in time.

        ``requests`` are by node. A request without a response is sent again every second.
        """
        systems = self._systems_of_nodes(kind)
        calls: dict[str, tuple[Any, Any]] = {}
        for_managers: dict[str, dict[str, Any]] = {}
        for node, request in requests.items():
            name = f"{node}/{_name(kind)}"
            if node in systems:
                for_managers.setdefault(_service(systems[node]), {})[name] = request
            else:
                calls[name] = (kind, request)
        documents = {service: _document(items) for service, items in for_managers.items()}
        for service, document in documents.items():
            calls[service] = (RequestService, request_message(document))
        answers = self._caller.call_each(calls, deadline)
        found = {node: answers.get(f"{node}/{_name(kind)}") for node in requests}
        for service, document in documents.items():
            if answers[service] is not None:
                found |= _responses(kind, document, answers[service])
        return found

    def states(self, nodes: Iterable[str], deadline: Deadline) -> dict[str, str | None]:
        """Return the label of each node's state, None for those that did not respond in time."""
        responses = self.call_all(GetState, dict.fromkeys(nodes, GetState.Request()), deadline)
        return {
            node: None if response is None else str(response.current_state.label)
            for node, response in responses.items()
        }

    def reports(self, deadline: Deadline) -> dict[str, SystemReport | None]:
        """Return the reports of the known systems, None for those that do not respond."""
        names = {*self._systems.discover(), *local_systems()}
        return self._systems.reports(names, deadline.at_most(REPORT_WITHIN_S))

    def _wait_for_reports(self, deadline: Deadline) -> None:
        new = set(self._systems.discover()) - self._awaited  # wait for each manager only once
        limit = deadline.at_most(REPORT_WITHIN_S)

        def have_reported() -> bool:
            reports = self._systems.current()
            return all(reports[name] or self._systems.other_version(name) for name in new)

        self._session.wait_for(have_reported, limit)
        self._awaited |= new

    def _left(self, service: str) -> Iterator[tuple[str, str]]:
        """Yield the nodes that leave a service to a manager, with the names of its system.

        The manager of the process of a node comes last: it has its parameters.
        """
        found = [
            (bool(node.process), node.node, name)
            for name, report in self._systems.current().items()
            for node in (() if report is None else report.nodes)
            if is_valid_name(node.node)
            and any(service in _SERVICES.get(kind, ()) for kind in node.left_to_manager)
        ]
        for _, node, name in sorted(found, reverse=True):
            yield node, name

    def _systems_of_nodes(self, kind: Any) -> dict[str, str]:
        """Return the systems whose managers have a service of nodes, by these nodes."""
        return dict(self._left(_name(kind)))


def _name(kind: Any) -> str:
    """Return ``get_state`` for the class ``GetState``."""
    return re.sub(r"\B(?=[A-Z])", "_", kind.__name__).lower()


def _service(system: str) -> str:
    return f"{system}/{NAME}/{REQUEST}"


def _document(requests: Mapping[str, Any]) -> CallNodes:
    return CallNodes(tuple(NodeCall(name, to_plain(item)) for name, item in requests.items()))


def _responses(kind: Any, document: CallNodes, answer: Any) -> Iterator[tuple[str, Any]]:
    """Yield the responses of class ``kind`` to the calls of a request, by node."""
    with suppress(ProtocolError):
        responses = read_answer(answer, document).responses
        for call, plain in zip(document.calls, responses, strict=False):
            with suppress(MessageError):
                if plain is not None:
                    node = call.service.rpartition("/")[0]
                    yield node, convert_message(plain, kind.Response, call.service)
