"""What the parts of one running node share."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any, TypeVar

from rclpy.callback_groups import CallbackGroup, MutuallyExclusiveCallbackGroup
from rclpy.node import Node

from composer.behavior import CallCancelled
from composer.runtime.callbacks.chains import NodeChains
from composer.runtime.callbacks.log import ErrorLog, Log
from composer.runtime.callbacks.mutation_check import MutationCheck
from composer.runtime.clock.clock import Clock
from composer.runtime.executors.event_counts import AnnouncedEvents
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.strand import Strand
from composer.runtime.executors.tasks import Cancelled, Future
from composer.runtime.executors.user_code import calls_user_code
from composer.runtime.intra_process.lifecycle_gate import Gate
from composer.runtime.intra_process.router import Delivery
from composer.runtime.metrics.statistics import Statistics

T = TypeVar("T")

_NANOSECONDS = 1e9


@dataclass(slots=True)
class NodeContext:
    """One node's ROS handle, loop, clock, gate, log and counters.

    ``delivery`` is where its ports meet those of other nodes of the process, ``chains`` what they
    have to do with the chains of the system, ``events`` tells of QoS events. ``mutations`` is there
    when changes of messages are looked for. ``names`` is what every expression of the node may
    use: ``parameters``, ``state``, ``node``. ``group`` is the callback group of its ports. ``used``
    is what most of its callbacks use: the behaviour, and what that publishes with.
    """

    node: Node
    loop: Loop
    clock: Clock
    gate: Gate
    strand: Strand
    log: Log
    error_log: ErrorLog
    statistics: Statistics
    names: dict[str, Any]
    delivery: Delivery
    chains: NodeChains
    events: AnnouncedEvents
    mutations: MutationCheck | None = None
    tasks: set[Future[Any]] = field(default_factory=set)
    group: CallbackGroup = field(default_factory=MutuallyExclusiveCallbackGroup)
    used: tuple[object, ...] = ()

    def now_s(self) -> float:
        """Return the node's time in seconds."""
        # Not by way of ``now()``, which makes a Time: many a callback asks for it.
        return float(self.node.get_clock().handle.get_now().nanoseconds / _NANOSECONDS)

    def spawn(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run ``coroutine`` on the node's loop; it ends at the latest with the node's entities."""
        task = self.loop.run_task(coroutine)
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)
        return task

    def cancel_tasks(self) -> None:
        """End every coroutine of the node's ports."""
        for task in tuple(self.tasks):
            task.cancel()

    @calls_user_code
    def call(
        self, name: str, function: Callable[..., Any], *arguments: Any
    ) -> Coroutine[Any, Any, None] | None:
        """Call user code whose result nobody wants; whatever it raises becomes a fault of ``name``.

        Returns the rest of it where it is ``async``.
        """
        try:
            result = function(*arguments)
        except BaseException as error:
            self.error_log.exception(name, error)
            return None
        return None if result is None else self.rest_of(name, result)

    def rest_of(self, name: str, result: object) -> Coroutine[Any, Any, None] | None:
        """Return the rest of what user code has begun, where it is ``async``; see :meth:`call`."""
        return self._rest(name, result) if isinstance(result, Awaitable) else None

    @calls_user_code
    async def _rest(self, name: str, result: Awaitable[Any]) -> None:
        try:
            await result
        except BaseException as error:
            self.take(name, error)

    def take(self, name: str, error: BaseException) -> None:
        """Make ``error``, caught from user code that was awaited, a fault of ``name``.

        Raises it again when it is what ends the coroutine; that a call or a sleep was ended because
        the node left *active* is no fault.
        """
        if isinstance(error, (Cancelled, GeneratorExit)):
            raise error
        if isinstance(error, CallCancelled) and not self.gate.incoming:
            self.log.debug(f"{name}: {error}")
        else:
            self.error_log.exception(name, error)
