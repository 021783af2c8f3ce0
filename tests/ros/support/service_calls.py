"""Calls of services by hand-written nodes, whose responses cannot be lost.

A server of rmw_fastrtps drops its response if it has not discovered the client within 0.1 s. A
client is therefore kept, and used once the process of the server is known to have discovered it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import GetParameters
from rclpy.action import ActionClient, ActionServer
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from composer.runtime.ros.graph import participant, servers_of

_REPEAT_AFTER_S = 0.5
#: Names of service types that change nothing begin with these.
_READS = ("Get", "List", "Describe", "Plan")
#: Types of services that every node may call at any time.
_SAFE = {"rcl_interfaces/srv/GetParameters": GetParameters, "lifecycle_msgs/srv/GetState": GetState}


def ids_of(servers: Iterable[TopicEndpointInfo]) -> set[bytes]:
    """Return the ids of endpoints."""
    return {bytes(server.endpoint_gid) for server in servers}


class ServiceClients:
    """The clients of a node; ``wait`` waits for a condition, during which the node is spun."""

    def __init__(self, node: Node, wait: Callable[[Callable[[], bool], str], object]) -> None:
        self._node = node
        self._wait = wait
        self._clients: dict[str, _Client] = {}

    def client(self, kind: Any, name: str) -> Any:
        """Return the client of a service when a server has discovered it."""
        client = self._client(kind, name)
        self._wait(lambda: bool(client.acquainted()), f"service {name}")
        return client.of_rclpy

    def call(self, kind: Any, name: str, request: Any = None) -> Any:
        """Call a service and return its response.

        If the request changes something, it is sent once to each server; otherwise repeatedly.
        """
        call = self.begin(kind, name, request)
        self._wait(call.done, f"a response of {name}")
        return call.result()

    def begin(self, kind: Any, name: str, request: Any = None) -> Call:
        """Send a request when a server has discovered the client; do not wait for a response."""
        call = self._client(kind, name).call(request or kind.Request())
        self._wait(lambda: call.done() or call.is_sent, f"service {name}")
        return call

    def wait_until_acquainted(self, name: str) -> None:
        """Wait until a server has discovered everything that the node has created so far."""
        acquaintance = Acquaintance(self._node, self._node.resolve_service_name(name))
        self._wait(lambda: bool(acquaintance.servers()), f"service {name}")

    def _client(self, kind: Any, name: str) -> _Client:
        name = self._node.resolve_service_name(name)
        if name not in self._clients:
            self._clients[name] = _Client(self._node, kind, name)
        return self._clients[name]


class ServiceUser:
    """Requests from a hand-written node; a derived class says how to wait."""

    node: Node

    def __init__(self, node: Node) -> None:
        self.node = node
        self._services = ServiceClients(node, self.wait_until)

    def wait_until(self, condition: Callable[[], Any], what: str = "") -> object:
        """Wait until the condition holds, while the node is spun."""
        raise NotImplementedError

    def client(self, kind: Any, name: str) -> Any:
        """Return a client whose responses are not lost; see :class:`.ServiceClients`."""
        return self._services.client(kind, name)

    def action_client(self, kind: Any, name: str) -> ActionClient:
        """Return a client whose responses are not lost."""
        client = ActionClient(self.node, kind, name)
        self.wait_until(client.server_is_ready, f"action {name}")
        self._services.wait_until_acquainted(f"{name}/_action/send_goal")
        return client

    def call(self, kind: Any, name: str, request: Any = None) -> Any:
        """Call a service and return its response; see :class:`.ServiceClients`."""
        return self._services.call(kind, name, request)

    def begin(self, kind: Any, name: str, request: Any = None) -> Call:
        """Send a request; return the call, for :func:`.finished`."""
        return self._services.begin(kind, name, request)

    def begin_change(self, node: str, transition: str | int) -> Call:
        """Request a transition by its label or its id; return the call."""
        key = "label" if isinstance(transition, str) else "id"
        request = ChangeState.Request(transition=Transition(**{key: transition}))
        return self.begin(ChangeState, f"{node}/change_state", request)

    def change_state(self, node: str, transition: str | int) -> bool:
        """Request a transition by its label or its id; return its success."""
        call = self.begin_change(node, transition)
        self.wait_until(call.done, f"a response of {node}")
        return bool(call.result().success)

    def state(self, node: str) -> str:
        """Return the label of a node's lifecycle state."""
        return str(self.call(GetState, f"{node}/get_state").current_state.label)


class _Client:
    """A client, and whether its servers have discovered it."""

    def __init__(self, node: Node, kind: Any, name: str) -> None:
        self.of_rclpy = node.create_client(kind, name)
        self._is_read = kind.__name__.startswith(_READS)
        self._node = node
        self._name = name
        self._acquaintance = Acquaintance(node, name)

    def call(self, request: Any) -> Call:
        if self._is_read:
            return Call(self.of_rclpy, request, self.discovered, _REPEAT_AFTER_S)
        return Call(self.of_rclpy, request, self.acquainted, math.inf)

    def discovered(self) -> set[bytes]:
        """Return all servers when one of them is available."""
        return (
            ids_of(servers_of(self._node, self._name))
            if self.of_rclpy.service_is_ready()
            else set()
        )

    def acquainted(self) -> set[bytes]:
        """Return all servers when they are available and have discovered the client."""
        return self._acquaintance.servers() if self.of_rclpy.service_is_ready() else set()


class Call:
    """A request, sent again to new servers, and after a time.

    A request goes to the servers that are discovered. One of them may belong to a killed process,
    which is discovered for 20 s. When another one is discovered, it cannot have got the request.
    """

    def __init__(
        self,
        client: Any,
        request: Any,
        servers: Callable[[], set[bytes]],
        repeat_after_s: float,
    ) -> None:
        self._client = client
        self._request = request
        self._servers = servers
        self._repeat_after_s = repeat_after_s
        self._asked: set[bytes] = set()
        self._sent_s = 0.0
        self._futures: list[Any] = []

    def done(self) -> bool:
        """Send the request if that is due; return whether there is a response."""
        if any(future.done() for future in self._futures):
            return True
        servers = self._servers()
        is_due = time.monotonic() > self._sent_s + self._repeat_after_s
        if servers and (is_due or not servers <= self._asked):
            self._asked |= servers
            self._sent_s = time.monotonic()
            self._futures.append(self._client.call_async(self._request))
        return False

    @property
    def is_sent(self) -> bool:
        return bool(self._futures)

    def result(self) -> Any:
        """Return the response."""
        return next(future.result() for future in self._futures if future.done())


class Acquaintance:
    """Which servers of a service have discovered what a node has created before.

    Endpoints are announced in order: who responds to a newer client knows all older ones.
    """

    def __init__(self, node: Node, name: str) -> None:
        self._node = node
        self._name = name
        self._known: set[bytes] = set()  # participants
        self._calls: dict[bytes, Call] = {}

    def servers(self) -> set[bytes]:
        """Return all servers when they have discovered the node; none before.

        One response is enough: the other servers may belong to a killed process.
        """
        servers = servers_of(self._node, self._name)
        unknown = set(map(participant, servers)) - self._known
        if unknown and not self._has_response(unknown):
            return set()
        self._known |= unknown
        return ids_of(servers)

    def _has_response(self, participants: set[bytes]) -> bool:
        """Send requests to participants until one responds."""
        for process, (name, kind) in self._services_to_call(participants - self._calls.keys()):
            self._calls[process] = _Client(self._node, kind, name).call(kind.Request())
        responded = [process for process, call in self._calls.items() if call.done()]
        if not responded:
            return False
        self._calls.clear()  # their clients would be too old for the next participant
        return True

    def _services_to_call(
        self, participants: set[bytes]
    ) -> Iterator[tuple[bytes, tuple[str, Any]]]:
        """Yield the name and the type of a service of each participant that is safe to call."""
        if not participants:
            return
        services = self._node.get_service_names_and_types()
        # The manager node of a system has an executor of its own, which no node can block.
        for name, types in sorted(services, key=lambda service: "/manager/" not in service[0]):
            if types[0] in _SAFE:
                found = set(map(participant, servers_of(self._node, name)))
                for process in found & participants:
                    yield process, (name, _SAFE[types[0]])
                participants = participants - found


def leave(node: Node) -> None:
    """Destroy a hand-written node with its actions.

    rclpy's ``destroy_node`` does not destroy actions, which keep the node and its participant until
    a garbage collection.
    """
    for waitable in list(node.waitables):
        if isinstance(waitable, (ActionClient, ActionServer)):
            waitable.destroy()
    node.destroy_node()
