"""Service calls of commands. Reads are retried every second; writes are sent once.

A server of rmw_fastrtps waits 0.1 s for a client that it has not discovered yet, and then drops the
response without an error. It has discovered the client when a retry arrives. A request that is sent
once waits for that before: a process announces its clients in order, so a server that responds to a
later client of this process has discovered the earlier ones.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from contextlib import closing
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.task import Future

from composer.client.graph_names import type_mismatch_hint
from composer.client.session import Deadline, NoResponseError, Session
from composer.model.names import join_node_name
from composer.runtime.ros.graph import participant, servers_of

_RETRY_AFTER_S = 1.0
#: A process that does not respond for so long is busy, and has discovered the client long ago.
_KNOWN_WITHIN_S = 2.0
#: A service that most nodes have, and that changes nothing.
_READ_SERVICE = "get_parameters"
_READ_TYPE = "rcl_interfaces/srv/GetParameters"


class ServiceCaller:
    """Calls services. Clients are slow to create, so they are kept until ``close``."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._clients: dict[str, Client] = {}
        #: The processes with a service that have discovered its client.
        self._knowing: dict[str, frozenset[bytes]] = {}

    def close(self) -> None:
        """Destroy all clients."""
        for client in self._clients.values():
            self._session.node.destroy_client(client)
        self._clients.clear()

    def call_each(self, calls: Mapping[str, tuple[Any, Any]], deadline: Deadline) -> dict[str, Any]:
        """Return the response of each service, None for those that did not respond in time.

        ``calls`` has the class of each service and the request, which is sent again every second
        until there is a response.
        """
        return self._call(calls, deadline, _RETRY_AFTER_S)

    def call_once(self, service: Any, name: str, request: Any, deadline: Deadline) -> Any:
        """Return the response to a request that is sent only once. Raises NoResponseError."""
        client = self._client(service, name)
        if not self._session.wait_for(client.service_is_ready, deadline):
            text = f"no server of service '{name}' found within {deadline.timeout_s:g} s"
            raise self._error(text, service, name)
        servers = frozenset(map(participant, servers_of(self._session.node, name)))
        if servers != self._knowing.get(name):
            wait_until_known(self._session, name, deadline)
            self._knowing[name] = servers
        response = self._call({name: (service, request)}, deadline, math.inf)[name]
        if response is None:
            raise self._error(_silence(name, deadline), service, name)
        return response

    def _error(self, text: str, service: Any, name: str) -> NoResponseError:
        hint = type_mismatch_hint(self._session, "service", name, type_of(service))
        return NoResponseError(text, hint)

    def _call(
        self, calls: Mapping[str, tuple[Any, Any]], deadline: Deadline, retry_after_s: float
    ) -> dict[str, Any]:
        sent = {
            name: _PendingCall(self._client(service, name), request, retry_after_s)
            for name, (service, request) in calls.items()
        }
        try:
            pending = list(sent.values())
            while pending and not deadline.passed:
                for call in pending:
                    call.send_if_due()
                self._session.spin_once(deadline)
                pending = [call for call in pending if call.response is None]
            return {name: call.response for name, call in sent.items()}
        finally:
            for call in sent.values():
                call.cancel()

    def _client(self, service: Any, name: str) -> Client:
        if name not in self._clients:
            self._clients[name] = self._session.node.create_client(service, name)
        return self._clients[name]


def wait_until_known(session: Session, service: str, deadline: Deadline) -> bool:
    """Wait until the server of a service has discovered all clients that the session has created.

    The server must be discovered. Return False if that is not certain: its process has no parameter
    services, or does not respond for some seconds.
    """
    read_service = _read_service(session, service)
    if read_service is None:
        return False
    limit = deadline.at_most(_KNOWN_WITHIN_S)
    request = GetParameters.Request()
    with closing(ServiceCaller(session)) as caller:
        responses = caller.call_each({read_service: (GetParameters, request)}, limit)
    return responses[read_service] is not None


def type_of(service: Any) -> str:
    """Return the type of a class of services: ``std_srvs/srv/Trigger``."""
    return f"{service.__module__.partition('.')[0]}/srv/{service.__name__}"


def required(responses: Mapping[str, Any], deadline: Deadline) -> Any:
    """Return the response of the only service. Raises NoResponseError."""
    ((name, response),) = responses.items()
    if response is None:
        raise NoResponseError(_silence(name, deadline))
    return response


def _silence(name: str, deadline: Deadline) -> str:
    return f"service '{name}' did not respond within {deadline.timeout_s:g} s"


def _read_service(session: Session, service: str) -> str | None:
    """Return a service of the same process that changes nothing; of the same node if it has one."""
    servers = servers_of(session.node, service)
    processes = set(map(participant, servers))
    own = {
        f"{join_node_name(server.node_namespace, server.node_name)}/{_READ_SERVICE}"
        for server in servers
    }
    known = [name for name, types in session.graph.services() if _READ_TYPE in types]
    for name in sorted(known, key=own.__contains__, reverse=True):
        if not processes.isdisjoint(map(participant, servers_of(session.node, name))):
            return name
    return None


class _PendingCall:
    """A request that is sent when the server is available, and again until it responds."""

    def __init__(self, client: Client, request: Any, retry_after_s: float) -> None:
        self._client = client
        self._request = request
        self._retry_after_s = retry_after_s
        self._due_s = 0.0
        self._sent: list[Future] = []

    @property
    def response(self) -> Any:
        """The first response that has arrived, None before."""
        return next((future.result() for future in self._sent if future.done()), None)

    def send_if_due(self) -> None:
        """Send the request if it is due and the server is available."""
        now_s = time.monotonic()
        if now_s >= self._due_s and self._client.service_is_ready():
            self._sent.append(self._client.call_async(self._request))
            self._due_s = now_s + self._retry_after_s

    def cancel(self) -> None:
        """Discard late responses."""
        for future in self._sent:
            self._client.remove_pending_request(future)
