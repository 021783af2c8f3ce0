"""The loop of ``kind: events``: the composer's scheduler, serving ROS entities."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.client import Client
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription

from composer.runtime.executors import actions
from composer.runtime.executors import entity_sources as sources
from composer.runtime.executors.entity_sources import Source, comes_by_itself
from composer.runtime.executors.loop import ExceptionHandler, Reply, Taken
from composer.runtime.executors.node_executor import NodeExecutor
from composer.runtime.executors.scheduler import Scheduler
from composer.runtime.executors.source_group import Slot

_EXPIRY_PERIOD_S = 1.0  # how often action servers drop the results that nobody fetched


class EventLoop(Scheduler):
    """A :class:`~composer.runtime.executors.loop.Loop` of one thread."""

    def __init__(self, name: str, on_exception: ExceptionHandler) -> None:
        super().__init__(name, on_exception)
        self._slots_of: dict[object, Slot] = {}  # by the entity that was added
        self._nodes: dict[Node, _NodeEntities] = {}
        self._futures = NodeExecutor(self, lambda: None)
        # An entity has one announcement only, so two threads must not hand it to two slots.
        self._changing = threading.RLock()

    def add_node(self, node: Node) -> None:
        """Serve what every node brings along: its services, its clock, its QoS events."""
        with self._changing:
            self._nodes[node] = _NodeEntities(self, node, self._changing)

    def remove_node(self, node: Node) -> None:
        """Stop serving the node and everything of it."""
        with self._changing:
            entities = self._nodes.pop(node, None)
            if entities is not None:
                entities.close()
            for entity in _entities_of(node):
                self.remove(entity)

    def add_subscription(
        self, subscription: Subscription, callback: Callable[[Taken], None]
    ) -> None:
        """Call ``callback((message, information))`` for each message."""
        self._add(subscription, sources.SubscriptionSource(subscription, callback))

    def add_service(self, service: Service, callback: Callable[[Any, Reply], None]) -> None:
        """Call ``callback(request, reply)``; ``reply(response)`` answers, now or later."""
        self._add(service, sources.ServiceSource(service, callback))

    def add_client(self, client: Client) -> None:
        """Complete the futures of ``client.call_async``."""
        self._add(client, sources.ClientSource(client, self._futures))

    def add_action_server(self, server: ActionServer) -> None:
        """Run the server's goal, cancel and result requests."""
        actions.contain(server, self._report)
        self._add(server, actions.ActionSource(server, self._futures, self))
        self.call_later(_EXPIRY_PERIOD_S, lambda: self._expire(server))

    def add_action_client(self, client: ActionClient) -> None:
        """Complete the futures of the client and deliver its feedback."""
        self._add(client, actions.ActionSource(client, self._futures, self))

    def remove(self, entity: object) -> None:
        """Stop serving one entity. To be called before it is destroyed."""
        with self._changing:
            slot = self._slots_of.pop(entity, None)
            if slot is not None:
                self.close_slot(slot)

    def own_source(self, entity: object) -> Source | None:
        """Return the source for what came with a node, or None where there is nothing to do."""
        return sources.source_of(entity, self._futures, self.run_task)

    def _add(self, entity: object, source: Source) -> None:
        with self._changing:
            self.remove(entity)
            for entities in self._nodes.values():
                entities.let_go(entity)
            self._slots_of[entity] = self.open_slot(source)

    def _expire(self, server: ActionServer) -> None:
        if server not in self._slots_of:
            return
        self.call_later(_EXPIRY_PERIOD_S, lambda: self._expire(server))
        if actions.keeps_goals(server):
            self.run_task(actions.forget_expired_goals(server))


class _NodeEntities:
    """What a node has and nobody added: served together, on one signal.

    Rarely used, all of it; a file descriptor for each would be thousands in a large system.
    """

    def __init__(self, loop: EventLoop, node: Any, changing: threading.RLock) -> None:
        self._loop = loop
        self._node = node
        self._changing = changing
        self._slot = loop.open_slot()
        self._sources: dict[object, Source] = {}
        self._look_due = False
        self._closed = False
        self._executor = NodeExecutor(loop, self._look_soon)  # the node refers to it weakly
        node.executor = self._executor
        for entity in _entities_of(node):
            self._serve(entity)

    def let_go(self, entity: object) -> None:
        """Leave the entity to whoever adds it by itself."""
        source = self._sources.pop(entity, None)
        if source is not None:
            self._slot.discard(source)

    def close(self) -> None:
        """Serve nothing of the node any more."""
        self._closed = True
        self._node.executor = None
        self._sources.clear()
        self._loop.close_slot(self._slot)

    def _look_soon(self) -> None:
        if not self._look_due:
            self._look_due = True
            self._loop.call_soon(self._look)

    def _look(self) -> None:
        """Find what the node got or lost meanwhile."""
        with self._changing:
            self._look_due = False
            if self._closed:
                return
            present = _entities_of(self._node)
            for gone in self._sources.keys() - set(present):
                self.let_go(gone)
            for entity in filter(comes_by_itself, present):
                self._serve(entity)

    def _serve(self, entity: object) -> None:
        source = None if entity in self._sources else self._loop.own_source(entity)
        if source is None:
            return
        try:
            self._slot.add(source)
        except InvalidHandle:
            return  # destroyed meanwhile
        self._sources[entity] = source


def _entities_of(node: Any) -> list[object]:
    return [*node.subscriptions, *node.services, *node.clients, *node.waitables]
