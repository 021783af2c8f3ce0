"""How a node is run, and what all nodes of the process share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node as RosNode

from composer.fast_dataclass import dataclass
from composer.model import LogLevel
from composer.runtime.callbacks.chains import Chains
from composer.runtime.callbacks.mutation_check import MessageSnapshots
from composer.runtime.clock.sim_time import SimTimeSource
from composer.runtime.executors.event_counts import EventCounts
from composer.runtime.intra_process.router import LocalRouter
from composer.runtime.transforms.listener import TransformListeners


@dataclass(frozen=True, slots=True)
class ProcessContext:
    """What all nodes of the process share: the manager node, and what runs on its loop."""

    manager: RosNode
    simulated_time: SimTimeSource
    events: EventCounts
    transforms: TransformListeners


@dataclass(frozen=True, slots=True)
class NodeOptions:
    """How a node is run.

    ``router`` connects its ports with those of the other nodes of the process; ``chains`` are
    those of the system; ``seen_messages`` is set if messages are checked for changes by callbacks;
    ``system_is_up`` is false during the bring-up, when errors do not count as faults: some nodes
    wait for others.
    ``make_library_node(node)`` returns the rclpy node that the libraries of its behavior use.
    """

    router: LocalRouter
    chains: Chains
    process: ProcessContext
    seen_messages: MessageSnapshots | None = None
    log_level: LogLevel = LogLevel.INFO
    transition_timeout_s: float = 10.0
    system_is_up: bool = False
    make_library_node: Callable[[Any], Any] | None = None
