"""The loop of an executor: calls, timers, tasks, and the ROS entities that it serves."""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.client import Client
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.task import Future as RclpyFuture

from composer.model import ExecutorKind
from composer.runtime.clock import COMPUTER, Clock
from composer.runtime.executors.actions import ActionSource
from composer.runtime.executors.readiness import EntitySource, SourceGroup
from composer.runtime.executors.scheduler import Scheduler
from composer.runtime.executors.sources import (
    ClientSource,
    Reply,
    ServiceSource,
    SubscriptionSource,
    Taken,
    rclpy_callback,
)
from composer.runtime.executors.tasks import Report, name_of


class Loop(Scheduler):
    """Calls callbacks on one thread at a time, or on several. Any thread may call its methods.

    An exception of a callback, SystemExit and KeyboardInterrupt included, goes to the exception
    handler with the callback's name, and the loop continues. An entity is served from when it is
    added, including what it received before, until it is removed.
    """

    def __init__(
        self,
        name: str,
        on_exception: Report,
        kind: ExecutorKind = ExecutorKind.EVENTS,
        threads: int = 1,
        clock: Clock = COMPUTER,
    ) -> None:
        """Create a loop, not started, for an executor of this name in YAML.

        ``threads`` counts for ``multi_threaded`` only. The loop of a system has the ``clock`` of
        the system. rclpy must be initialized.
        """
        super().__init__(name, on_exception, kind, threads, clock)
        self._group_of: dict[object, SourceGroup] = {}  # by the entity that was added
        #: What runs rclpy's own code, to which nodes refer weakly, and their services.
        self._nodes: dict[Node, tuple[NodeExecutor, SourceGroup]] = {}
        # rcl has one callback per entity, so two threads must not add it to two groups.
        self._changing = threading.RLock()

    @property
    def _executor(self) -> NodeExecutor:
        return NodeExecutor(self)

    def add_node(self, node: Node) -> None:
        """Serve the services that a node has now, by their own callbacks: those for parameters.

        All of them are one group: they are rarely used, and a file descriptor for each would be
        thousands in a large system. Everything else must be added.
        """
        services: Iterable[Any] = node.services
        sources = [
            ServiceSource(service, rclpy_callback(service, self.run_task)) for service in services
        ]
        with self._changing:
            executor = self._executor
            self._nodes[node] = executor, self.add_group(*sources)
            node.executor = executor  # type: ignore[assignment]  # the part that rclpy uses

    def remove_node(self, node: Node) -> None:
        """Stop serving the node and all its entities. Call it before the node is destroyed."""
        with self._changing:
            _, group = self._nodes.pop(node, (None, None))
            if group is not None:
                node.executor = None  # type: ignore[assignment]
                self.remove_group(group)
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
        """Handle the server's goal, cancel and result requests. Its callbacks must not raise."""
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

    def _serve(self, entity: object, source: EntitySource) -> None:
        with self._changing:
            self.remove(entity)
            self._group_of[entity] = self.add_group(source)


def _entities_of(node: Any) -> list[object]:
    return [*node.subscriptions, *node.services, *node.clients, *node.waitables]


class NodeExecutor:
    """``node.executor``: the part of ``rclpy.executors.Executor`` that rclpy's own code uses.

    An ActionServer runs goals by ``create_task``, rclpy's futures their done callbacks.
    """

    def __init__(self, loop: Loop) -> None:
        self._loop = loop

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
        """Do nothing: entities are added and removed by methods of the loop."""

    def add_node(self, node: object) -> None:
        """Do nothing: nodes are added by ``Loop.add_node``."""

    def remove_node(self, node: object) -> None:
        """Do nothing: nodes are removed by ``Loop.remove_node``."""
