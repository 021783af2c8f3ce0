"""Calls of services that are sent again if they may have been lost."""

from __future__ import annotations

import time
from typing import Any

from rclpy.node import Node

#: A server drops its response if it has not discovered the client within 0.1 s.
_REPEAT_AFTER_S = 1.0
#: Names of service types that change nothing begin with these.
_READS = ("Get", "List", "Describe", "Plan")


def servers_of(node: Node, name: str) -> set[bytes]:
    """Return the ids of the servers of a service that a node has discovered."""
    endpoints = node.get_subscriptions_info_by_topic(f"rq{name}Request", no_mangle=True)
    return {bytes(endpoint.endpoint_gid) for endpoint in endpoints}


class ServiceCall:
    """One call, by a client of its own.

    A request goes to the servers that are discovered. One of them may belong to a killed process,
    which is known for 20 s. When another one is discovered, which cannot have got the request, it
    is sent again; and each second if it only reads.
    """

    def __init__(self, node: Node, kind: Any, name: str, request: Any = None) -> None:
        self._node = node
        self._name = node.resolve_service_name(name)
        self._request = request or kind.Request()
        self._is_read = kind.__name__.startswith(_READS)
        self._client = node.create_client(kind, name)
        self._asked: set[bytes] = set()
        self._sent_s = 0.0
        self._futures: list[Any] = []

    def is_done(self) -> bool:
        """Send the request if that is due; return whether there is a response."""
        if any(future.done() for future in self._futures):
            return True
        servers = servers_of(self._node, self._name)
        is_due = self._is_read and time.monotonic() > self._sent_s + _REPEAT_AFTER_S
        if (is_due or not servers <= self._asked) and self._client.service_is_ready():
            self._asked |= servers
            self._sent_s = time.monotonic()
            self._futures.append(self._client.call_async(self._request))
        return False

    def result(self) -> Any:
        """Return the response."""
        return next(future.result() for future in self._futures if future.done())

    def close(self) -> None:
        """Destroy the client, on the thread that spins the node."""
        self._node.destroy_client(self._client)
