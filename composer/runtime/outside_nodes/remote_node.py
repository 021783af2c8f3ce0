"""A node in another process: whether it is in the ROS graph, and its lifecycle services."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.node import Node as RosNode
from rclpy.topic_endpoint_info import TopicEndpointInfo

from composer.model import Node, Port, PortKind
from composer.model.lifecycle import PRIMARY_STATES, TRANSITIONS
from composer.model.names import join_node_name, split_node_name
from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.tasks import sleep, wait_for
from composer.runtime.middleware.local_resources import is_in_group
from composer.runtime.ros.graph import RosGraph, clients_of, participant, servers_of

#: Topics that nearly every node publishes.
_PARAMETER_EVENTS = "/parameter_events"  # each node has a publisher of its own
_COMMON_TOPICS = ("/rosout", _PARAMETER_EVENTS)
#: The service that every action server has.
_SEND_GOAL = "/_action/send_goal"
#: An answer that a server sends before it has discovered the client is lost.
_ASK_AGAIN_S = 1.0
_POLL_S = 0.02
_EVENTS_DEPTH = 20
_CONFIRMED_WITHIN_S = 5.0
#: The states of a node in another process of the system in which each transition has nothing to do:
#: a process that ran before the coordinating one keeps its nodes as they are.
DONE_IN = {
    "configure": ("inactive", "active"),
    "activate": ("active",),
    "deactivate": ("inactive", "unconfigured", "finalized"),
    "cleanup": ("unconfigured", "finalized"),
    "shutdown": ("finalized",),
}


class NodePresence:
    """The endpoints of one node, as the manager node has discovered them.

    DDS shows a killed process for 20 s more. An endpoint has the prefix of its participant, so the
    endpoints of an earlier process can be ignored: ``earlier`` are the :meth:`participants` at the
    start of this one.
    """

    def __init__(self, manager: RosNode, model: Node) -> None:
        self._manager = manager
        self._model = model
        names = map(split_node_name, (model.full_name, *model.inner_nodes))
        self._names = {(name, namespace) for namespace, name in names}
        program = model.executable
        #: False: any node may be one of its program.
        self._are_known = not (model.keeps_names and program is not None and not program.nodes)
        self.earlier: frozenset[bytes] = frozenset()

    def participants(self) -> frozenset[bytes]:
        """Return the prefixes of the participants with this node, as far as they are known."""
        found = self._common_endpoints()
        for port in self._model.ports:
            found += self._endpoints(port)
        return frozenset(map(participant, self._own(found)))

    def has_node(self) -> bool:
        """Return whether the node is in the graph, and not only as part of an earlier process."""
        if not self._are_known or self.participants() - self.earlier:
            return True
        return not self.earlier and not self._names.isdisjoint(RosGraph(self._manager).nodes())

    def namesakes(self) -> int:
        """Return how many nodes its process has created with its name, in any namespace."""
        events = self._manager.get_publishers_info_by_topic(_PARAMETER_EVENTS)
        name = self._model.ros_name.value
        counts = Counter(participant(event) for event in events if event.node_name == name)
        return max((counts[item] for item in self.participants() - self.earlier), default=0)

    def names_in(self, pid: int) -> set[str]:
        """Return the full names of the nodes in a process and its children."""
        return {
            join_node_name(endpoint.node_namespace, endpoint.node_name)
            for endpoint in self._common_endpoints()
            if is_in_group(participant(endpoint), pid)
        }

    def names_elsewhere(self) -> set[str]:
        """Return the full names of nodes with its name in other namespaces."""
        nodes = set(RosGraph(self._manager).nodes()) - self._names
        name = self._model.ros_name.value
        return {join_node_name(namespace, last) for last, namespace in nodes if last == name}

    def missing(self) -> tuple[Port, ...]:
        """Return the declared ports that the node does not have yet."""
        return tuple(
            port
            for port in self._model.ports
            if all(
                participant(endpoint) in self.earlier
                for endpoint in self._own(self._endpoints(port))
            )
        )

    def servers(self, service: str) -> frozenset[bytes]:
        """Return the participants in which the node provides a service, by its full name."""
        found = map(participant, self._own(servers_of(self._manager, service)))
        return frozenset(found) - self.earlier

    def _common_endpoints(self) -> list[TopicEndpointInfo]:
        return [
            endpoint
            for topic in _COMMON_TOPICS
            for endpoint in self._manager.get_publishers_info_by_topic(topic)
        ]

    def _own(self, endpoints: Iterable[TopicEndpointInfo]) -> Iterator[TopicEndpointInfo]:
        for endpoint in endpoints:
            name = (endpoint.node_name, endpoint.node_namespace)
            if not self._are_known or name in self._names:
                yield endpoint

    def _endpoints(self, port: Port) -> list[TopicEndpointInfo]:
        """Return the endpoints of all nodes that are like the port."""
        name = port.full_name
        match port.kind:
            case PortKind.PUBLISHER:
                return list(self._manager.get_publishers_info_by_topic(name))
            case PortKind.SUBSCRIPTION:
                return list(self._manager.get_subscriptions_info_by_topic(name))
            case PortKind.SERVICE:
                return servers_of(self._manager, name)
            case PortKind.CLIENT:
                return clients_of(self._manager, name)
            case PortKind.ACTION_SERVER:
                return servers_of(self._manager, name + _SEND_GOAL)
            case PortKind.ACTION_CLIENT:
                return clients_of(self._manager, name + _SEND_GOAL)


class NotAnswered(Exception):
    """A node did not answer in time."""


class RemoteServices:
    """Clients of services of one node. Use it on ``loop``."""

    def __init__(self, ros: RosNode, loop: Loop, full_name: str) -> None:
        self._ros = ros
        self._loop = loop
        self._clock = loop.clock
        self._full_name = full_name
        self._clients: list[Any] = []

    def close(self) -> None:
        """Destroy the clients."""
        while self._clients:
            client = self._clients.pop()
            self._loop.remove(client)
            self._ros.destroy_client(client)

    def _client(self, service: Any, name: str) -> Any:
        client = self._ros.create_client(service, f"{self._full_name}/{name}")
        self._clients.append(client)
        self._loop.add_client(client)
        return client

    async def _ask(self, client: Any, request: Any, end_s: float) -> Any:
        """Return the response to a request that is repeated each second.

        Raises NotAnswered at ``end_s`` (monotonic).
        """
        while True:
            future = client.call_async(request)
            try:
                response = await self._response(future, end_s)
            finally:
                client.remove_pending_request(future)
            if response is not None:
                return response

    async def _response(self, future: Any, end_s: float) -> Any:
        """Return the response, None if there is none within a second."""
        now_s = self._clock.monotonic()
        if now_s >= end_s:
            raise NotAnswered(f"{self._full_name} does not answer")
        is_done = await wait_for(self._loop, future, min(_ASK_AGAIN_S, end_s - now_s))
        return future.result() if is_done else None


class RemoteLifecycle(RemoteServices):
    """Clients of the lifecycle services of one node. Use it on ``loop``.

    A request for a transition is sent again only if the node is still in the state it was in.
    """

    def __init__(
        self,
        ros: RosNode,
        loop: Loop,
        full_name: str,
        on_state: Callable[[str, str], None],
    ) -> None:
        """``on_state(start, state)`` is called after transition events.

        ``start`` is the label of the state in which the last transition began. ``state`` is the
        primary state that the service of the node reports: any node can publish an event.
        """
        super().__init__(ros, loop, full_name)
        self._get_state = self._client(GetState, "get_state")
        self._change_state = self._client(ChangeState, "change_state")
        self._events = ros.create_subscription(
            TransitionEvent, f"{full_name}/transition_event", lambda _: None, _EVENTS_DEPTH
        )

        self._on_state = on_state
        self._event_start: str | None = None  # of the last event that is not confirmed yet
        self._confirmation: Future[None] | None = None
        loop.add_subscription(self._events, self._on_event)

    def close(self) -> None:
        """Destroy the clients."""
        if self._confirmation is not None:
            self._confirmation.cancel()
        super().close()
        self._loop.remove(self._events)
        self._ros.destroy_subscription(self._events)

    async def state(self, end_s: float) -> str:
        """Return the label of the state. Raises NotAnswered at ``end_s`` (monotonic)."""
        response = await self._ask(self._get_state, GetState.Request(), end_s)
        return str(response.current_state.label)

    async def change(self, transition: str, end_s: float) -> tuple[bool, str]:
        """Run a transition; return whether it succeeded, and the state after it.

        Raises NotAnswered at ``end_s`` (monotonic).
        """
        before = await self.state(end_s)
        request = ChangeState.Request(transition=Transition(label=transition))
        while True:
            future = self._change_state.call_async(request)
            try:
                response = await self._response(future, end_s)
                if response is None:
                    after = await self._settled(end_s)
                    if after != before:  # the response was lost, not the request
                        return after == TRANSITIONS[transition].goal, after
                    response = await self._response(future, end_s)  # it may be on its way
            finally:
                self._change_state.remove_pending_request(future)
            if response is not None:
                return bool(response.success), await self._settled(end_s)

    def _on_event(self, taken: tuple[Any, Any]) -> None:
        self._event_start = str(taken[0].start_state.label)
        if self._clients and self._confirmation is None:  # it may have been closed
            self._confirmation = self._loop.run_task(self._confirm())

    async def _confirm(self) -> None:
        """Ask the node for its state until no event has arrived meanwhile."""
        try:
            while (start := self._event_start) is not None:
                self._event_start = None
                state = await self._settled(self._clock.monotonic() + _CONFIRMED_WITHIN_S)
                self._on_state(self._event_start or start, state)
        except NotAnswered:
            self._event_start = None  # its disappearance is noticed elsewhere
        finally:
            self._confirmation = None

    async def _settled(self, end_s: float) -> str:
        """Return the state once no transition runs."""
        while (state := await self.state(end_s)) not in PRIMARY_STATES:
            await sleep(self._loop, _POLL_S)
        return state
