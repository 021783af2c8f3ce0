"""Service calls to many nodes at once, with clients that are kept for the next time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.client import Client
from rclpy.task import Future

from composer.runtime.session import Deadline, Session


class Asker:
    """Asks services. Making clients is what takes time, so they stay until ``close``."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._clients: dict[str, Client] = {}

    def close(self) -> None:
        """Destroy all clients."""
        for client in self._clients.values():
            self._session.node.destroy_client(client)
        self._clients.clear()

    def ask(self, service: Any, requests: Mapping[str, Any], deadline: Deadline) -> dict[str, Any]:
        """Return the response of each service, None of those that did not answer in time."""
        pending: dict[str, Future | None] = dict.fromkeys(requests)
        answers: dict[str, Any] = dict.fromkeys(requests)
        try:
            while pending and not deadline.passed:
                for name in list(pending):
                    future = pending[name] = pending[name] or self._sent(service, name, requests)
                    if future is not None and future.done():
                        answers[name] = future.result()
                        del pending[name]
                if pending:
                    self._session.spin_once(deadline)
        finally:
            for name, future in pending.items():
                if future is not None:
                    self._clients[name].remove_pending_request(future)
        return answers

    def _sent(self, service: Any, name: str, requests: Mapping[str, Any]) -> Future | None:
        """Send a request, if the server is there."""
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self._session.node.create_client(service, name)
        if not client.service_is_ready():
            return None
        future: Future = client.call_async(requests[name])
        return future
