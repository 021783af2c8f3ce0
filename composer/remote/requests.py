"""Service calls of commands. Reads are retried every second; writes are sent once."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from typing import Any, TypeAlias

from rclpy.client import Client
from rclpy.task import Future

from composer.remote.session import Deadline, NoResponseError, Session

#: A server of rmw_fastrtps waits 0.1 s for a client that it has not discovered yet, and then drops
#: the response without an error. It has discovered the client when the retry arrives.
_RETRY_AFTER_S = 1.0

#: How to send a request: :func:`call_with_retries` or :func:`call_once`.
Call: TypeAlias = Callable[[Session, Any, str, Any, Deadline], Any]


class ServiceCaller:
    """Calls services. Clients are slow to create, so they are kept until ``close``.

    A request without a response is sent again every ``retry_after_s`` seconds.
    """

    def __init__(self, session: Session, retry_after_s: float = _RETRY_AFTER_S) -> None:
        self._session = session
        self._retry_after_s = retry_after_s
        self._clients: dict[str, Client] = {}

    def close(self) -> None:
        """Destroy all clients."""
        for client in self._clients.values():
            self._session.node.destroy_client(client)
        self._clients.clear()

    def call_all(
        self, service: Any, requests: Mapping[str, Any], deadline: Deadline
    ) -> dict[str, Any]:
        """Return the response of each service, None for those that did not respond in time."""
        calls = {
            name: _PendingCall(self._client(service, name), request, self._retry_after_s)
            for name, request in requests.items()
        }
        try:
            pending = list(calls.values())
            while pending and not deadline.passed:
                for call in pending:
                    call.send_if_due()
                self._session.spin_once(deadline)
                pending = [call for call in pending if call.response is None]
            return {name: call.response for name, call in calls.items()}
        finally:
            for call in calls.values():
                call.cancel()

    def call(self, service: Any, name: str, request: Any, deadline: Deadline) -> Any:
        """Return the response of one service. Raises NoResponseError."""
        response = self.call_all(service, {name: request}, deadline)[name]
        if response is None:
            raise NoResponseError(
                f"service '{name}' did not respond within {deadline.timeout_s:g} s"
            )
        return response

    def _client(self, service: Any, name: str) -> Client:
        if name not in self._clients:
            self._clients[name] = self._session.node.create_client(service, name)
        return self._clients[name]


def call_all_with_retries(
    session: Session, service: Any, names: Iterable[str], request: Any, deadline: Deadline
) -> dict[str, Any]:
    """Send a read request to services of one type; None for those that did not respond in time."""
    with closing(ServiceCaller(session)) as caller:
        return caller.call_all(service, dict.fromkeys(names, request), deadline)


def call_with_retries(
    session: Session, service: Any, name: str, request: Any, deadline: Deadline
) -> Any:
    """Return the response to a request that changes nothing. Raises NoResponseError."""
    with closing(ServiceCaller(session)) as caller:
        return caller.call(service, name, request, deadline)


def call_once(session: Session, service: Any, name: str, request: Any, deadline: Deadline) -> Any:
    """Return the response to a request that is sent only once.

    Raises NoResponseError; the server may have handled the request nevertheless.
    """
    with closing(ServiceCaller(session, retry_after_s=math.inf)) as caller:
        return caller.call(service, name, request, deadline)


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
