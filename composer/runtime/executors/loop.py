"""The loop of an executor: calls, timers, tasks, and the ROS entities that it serves."""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.client import Client
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.task import Future as RclpyFuture

from composer.model import ExecutorKind
from composer.runtime.clock.clock import COMPUTER, Clock
from composer.runtime.executors.actions import ActionSource, contain_exceptions
from composer.runtime.executors.exceptions import exception_log
from composer.runtime.executors.readiness import EntitySource, SourceGroup
from composer.runtime.executors.scheduler import Scheduler
from composer.runtime.executors.sources import (
    ClientSource,
    Reply,
    ServiceSource,
    SubscriptionSource,
    Taken,
    is_implicit,
    source_of,
)
from composer.runtime.executors.tasks import Report, TaskRunner, name_of


class Loop(Scheduler):
    """Calls callbacks on one thread at a time, or on several. Any thread may call its methods.

    An exception of a callback, SystemExit and KeyboardInterrupt included, goes to the exception
    handler with the callback's name, and the loop continues. An entity is served from when it is
    added, including what it received before, until it is removed.
    """

    def __init__(
        self,
        name: str,
        on_exception: Report | None = None,
        kind: ExecutorKind = ExecutorKind.EVENTS,
        threads: int = 1,
        clock: Clock = COMPUTER,
    ) -> None:
        """Create a loop, not started, for an executor of this name in YAML.

        ``threads`` counts for ``multi_threaded`` only. The loop of a system has the ``clock`` of
        the system. Exceptions are logged by default. rclpy must be initialized.
        """
        super().__init__(name, on_exception or exception_log(clock), kind, threads, clock)
        self._group_of: dict[object, SourceGroup] = {}  # by the entity that was added
        self._nodes: dict[Node, _ImplicitEntities] = {}
        # rcl has one callback per entity, so two threads must not add it to two groups.
        self._changing = threading.RLock()

    @property
    def _executor(self) -> NodeExecutor:
        return NodeExecutor(self, lambda: None)

    def add_node(self, node: Node) -> None:
        """Serve the entities that rclpy creates for a node: parameter and logger services.

        Everything the node has now is served by its own callbacks. Of what it gets later, only the
        simulated clock and QoS events are served; other entities must be added.
        """
        with self._changing:
            self._nodes[node] = _ImplicitEntities(self, node, self._changing)

    def remove_node(self, node: Node) -> None:
        """Stop serving the node and all its entities. Call it before the node is destroyed."""
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
        self._serve(subscription, SubscriptionSource(subscription, callback))

    def add_service(self, service: Service, callback: Callable[[Any, Reply], None]) -> None:
        """Call ``callback(request, reply)``; ``reply(response)`` responds, now or later.

        If ``callback`` raises, the client gets an empty response. ``reply`` raises TypeError for
        another type than the service's response, RuntimeError if there was a response already.
        """
        self._serve(service, ServiceSource(service, callback))

    def add_client(self, client: Client) -> None:
        """Complete the futures of ``client.call_async``."""
        self._serve(client, ClientSource(client, self._executor))

    def add_action_server(self, server: ActionServer) -> None:
        """Handle the server's goal, cancel and result requests.

        If one of its callbacks raises, the goal is rejected or aborted, the cancellation rejected.
        """
        contain_exceptions(server, self.report)
        self._serve(server, ActionSource(server, self._executor, self))

    def add_action_client(self, client: ActionClient) -> None:
        """Complete the futures of the client and deliver its feedback."""
        self._serve(client, ActionSource(client, self._executor, self))

    def action_receiver(self, client: ActionClient) -> Callable[[dict[str, Any]], None]:
        """Return a function that passes to a client what came from a server of the process.

        It takes what ``client.take_data()`` returns, from any thread.
        """
        source = ActionSource(client, self._executor, self)
        return lambda taken: self.call_soon(partial(source.call, taken))

    def remove(self, entity: object) -> None:
        """Stop serving an entity. Call it before the entity is destroyed."""
        with self._changing:
            group = self._group_of.pop(entity, None)
            if group is not None:
                self.remove_group(group)

    def implicit_source(self, entity: object) -> EntitySource | None:
        """Return the source of an entity that rclpy created, or None if it needs none."""
        return source_of(entity, self._executor, self.run_task)

    def _serve(self, entity: object, source: EntitySource) -> None:
        with self._changing:
            self.remove(entity)
            for entities in self._nodes.values():
                entities.discard(entity)
            self._group_of[entity] = self.add_group(source)


class _ImplicitEntities:
    """The entities of a node that were not added explicitly, served as one group.

    All are rarely used. A file descriptor for each would be thousands in a large system.
    """

    def __init__(self, loop: Loop, node: Any, changing: threading.RLock) -> None:
        self._loop = loop
        self._node = node
        self._changing = changing
        self._group = loop.add_group()
        self._sources: dict[object, EntitySource] = {}
        self._update_pending = False
        self._closed = False
        self._executor = NodeExecutor(loop, self._update_soon)  # the node refers to it weakly
        node.executor = self._executor
        for entity in _entities_of(node):
            self._add(entity)

    def discard(self, entity: object) -> None:
        """Stop serving an entity: it was destroyed, or added explicitly."""
        source = self._sources.pop(entity, None)
        if source is not None:
            self._group.discard(source)

    def close(self) -> None:
        """Stop serving the node."""
        self._closed = True
        self._node.executor = None
        self._sources.clear()
        self._loop.remove_group(self._group)

    def _update_soon(self) -> None:
        if not self._update_pending:
            self._update_pending = True
            self._loop.call_soon(self._update)

    def _update(self) -> None:
        """Follow the entities that were created or destroyed meanwhile."""
        with self._changing:
            self._update_pending = False
            if self._closed:
                return
            present = _entities_of(self._node)
            for destroyed in self._sources.keys() - set(present):
                self.discard(destroyed)
            for entity in filter(is_implicit, present):
                self._add(entity)

    def _add(self, entity: object) -> None:
        source = None if entity in self._sources else self._loop.implicit_source(entity)
        if source is None:
            return
        try:
            self._group.add(source)
        except InvalidHandle:
            return  # destroyed meanwhile
        self._sources[entity] = source


def _entities_of(node: Any) -> list[object]:
    return [*node.subscriptions, *node.services, *node.clients, *node.waitables]


class NodeExecutor:
    """``node.executor``: the part of ``rclpy.executors.Executor`` that rclpy's own code uses.

    An ActionServer runs goals by ``create_task``, rclpy's futures their done callbacks. A node
    calls ``wake`` when one of its entities was created or destroyed.
    """

    def __init__(self, loop: TaskRunner, on_wake: Callable[[], None]) -> None:
        self._loop = loop
        self._on_wake = on_wake

    def create_task(self, callback: Callable[..., Any], *args: Any, **kwargs: Any) -> RclpyFuture:
        """Call ``callback``, plain or ``async def``, on the loop; return the future of its result.

        An exception goes to the loop's handler.
        """
        outcome = RclpyFuture()

        def call() -> None:
            outcome.set_result(callback(*args, **kwargs))

        async def run() -> None:
            outcome.set_result(await callback(*args, **kwargs))

        call.__qualname__ = run.__qualname__ = name_of(callback)
        if inspect.iscoroutinefunction(callback):
            self._loop.call_soon(partial(self._loop.run_task, run()))
        else:
            self._loop.call_soon(call)
        return outcome

    def wake(self) -> None:
        """Check the node's entities soon."""
        self._on_wake()

    def add_node(self, node: object) -> None:
        """Do nothing: nodes are added by ``Loop.add_node``."""

    def remove_node(self, node: object) -> None:
        """Do nothing: nodes are removed by ``Loop.remove_node``."""
