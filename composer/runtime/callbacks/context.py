"""The state that all parts of one running node share."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import field
from typing import Any, TypeVar

from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.node import Node

from composer.base.fast_dataclass import dataclass
from composer.behavior import CallCancelled
from composer.model import Port
from composer.runtime.callbacks.chains import NodeChains
from composer.runtime.callbacks.log import ErrorLog, Log
from composer.runtime.callbacks.mutation_check import MutationCheck
from composer.runtime.executors.event_counts import EventCounts
from composer.runtime.executors.exceptions import is_closing, text_of
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.stacks import calls_user_code
from composer.runtime.executors.strand import Strand
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate
from composer.runtime.intra_process.router import LocalRouter
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node_time.node_time import NodeTime

T = TypeVar("T")

_NANOSECONDS = 1e9


@dataclass(slots=True)
class NodeContext:
    """One node's ROS handle, loop, clock, gate, log and counters.

    ``router`` connects its ports to those of other nodes of the process, ``chains`` has its hops on
    the chains of the system, ``events`` reports QoS events. ``mutations`` is set if messages are
    checked for changes. ``names`` are the names of every expression of the node: ``parameters``,
    ``state``, ``node``. ``group`` is the callback group of its ports. ``hot_objects`` are used by
    most of its callbacks: the behavior and its publishers.
    """

    node: Node
    loop: Loop
    clock: NodeTime
    gate: LifecycleGate
    strand: Strand
    log: Log
    error_log: ErrorLog
    statistics: Statistics
    names: dict[str, Any]
    router: LocalRouter
    chains: NodeChains
    events: EventCounts
    mutations: MutationCheck | None = None
    tasks: set[Future[Any]] = field(default_factory=set)
    group: CallbackGroup = field(default_factory=MutuallyExclusiveCallbackGroup)
    hot_objects: tuple[object, ...] = ()

    def now_s(self) -> float:
        """Return the node's time in seconds."""
        # Not by ``now()``, which creates a Time: many callbacks read the time.
        return float(self.node.get_clock().handle.get_now().nanoseconds / _NANOSECONDS)

    def group_of(self, port: Port) -> CallbackGroup:
        """Return the callback group of a port: the shared one unless the port is reentrant."""
        return ReentrantCallbackGroup() if port.reentrant else self.group

    def spawn(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run ``coroutine`` on the node's loop, at most as long as the node's entities exist."""
        task = self.loop.run_task(coroutine)
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)
        return task

    def cancel_tasks(self) -> None:
        """Cancel every coroutine of the node's ports."""
        for task in tuple(self.tasks):
            task.cancel()

    @calls_user_code
    def call(
        self, name: str, function: Callable[..., Any], *arguments: Any
    ) -> Coroutine[Any, Any, None] | None:
        """Call user code and ignore its result; its exceptions are faults of ``name``.

        Returns the rest of the call if it is ``async``.
        """
        try:
            result = function(*arguments)
            return None if result is None else self.continuation(name, result)
        except BaseException as error:
            self.error_log.exception(name, error)
            return None

    def continuation(self, name: str, result: object) -> Coroutine[Any, Any, None] | None:
        """Return a coroutine that awaits a result of user code, or None if it is not awaitable."""
        return self._continue(name, result) if isinstance(result, Awaitable) else None

    @calls_user_code
    async def _continue(self, name: str, result: Awaitable[Any]) -> None:
        try:
            await result
        except BaseException as error:
            self.on_exception(name, error)

    def on_exception(self, name: str, error: BaseException) -> None:
        """Record an exception of awaited user code as a fault of ``name``.

        Call it where the exception was caught. Raises it again if it ends the coroutine. A call or
        sleep that was canceled because the node left *active* is not a fault.
        """
        kind = type(error)  # ``__class__`` may be a property of the user
        if issubclass(kind, Cancelled) or is_closing(error):
            raise error
        if issubclass(kind, CallCancelled) and not self.gate.incoming:
            self.log.debug(f"{name}: {text_of(error)}")
        else:
            self.error_log.exception(name, error)
