"""The state that all parts of one running node share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any

from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.node import Node
from rclpy.service import Service

from composer.base.fast_dataclass import dataclass
from composer.model import Port
from composer.runtime.callbacks.log import ErrorLog, Log
from composer.runtime.callbacks.observers import MutationCheck, NodeChains
from composer.runtime.callbacks.user_code import UserCode
from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import EventCounts, Reply
from composer.runtime.executors.strand import Strand
from composer.runtime.host_options import Instruments
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate
from composer.runtime.intra_process.router import LocalRouter
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node_time import NodeTime

_NANOSECONDS = 1e9


@dataclass(slots=True)
class NodeContext(UserCode):
    """One node's ROS handle, loop, clock, gate, log and counters.

    ``router`` connects its ports to those of other nodes of the process, ``chains`` has its hops on
    the chains of the system, ``events`` reports QoS events. ``mutations`` is set if messages are
    checked for changes. ``names`` are the names of every expression of the node: ``parameters``,
    ``state``, ``node``. ``group`` is the callback group of its ports. ``hot_objects`` are used by
    most of its callbacks: the behavior and its publishers. ``instruments`` belong to a test.
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
    instruments: Instruments | None = None

    def now_s(self) -> float:
        """Return the node's time in seconds."""
        # Not by ``now()``, which creates a Time: many callbacks read the time.
        return float(self.node.get_clock().handle.get_now().nanoseconds / _NANOSECONDS)

    def stamp(self) -> Any:
        """Return the node's time as a builtin_interfaces/msg/Time."""
        return self.node.get_clock().now().to_msg()

    def serve(self, service: Service, callback: Callable[[Any, Reply], None]) -> None:
        """Call ``callback(request, reply)`` for a service that no port declares."""
        self.loop.add_service(service, callback)
        self.router.offer(service, self.loop.call_soon, callback)

    def group_of(self, port: Port) -> CallbackGroup:
        """Return the callback group of a port: the shared one unless the port is reentrant."""
        return ReentrantCallbackGroup() if port.reentrant else self.group
