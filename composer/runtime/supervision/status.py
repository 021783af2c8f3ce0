"""What is known of a running system at a moment: for the manager node, and whoever asks it."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from composer.model import PrimaryState, System
from composer.plan import start_goals
from composer.runtime.metrics.statistics import Statistics


@dataclass(frozen=True, slots=True)
class NodeStatus:
    """One node. ``since_s`` is when it came into its state, in seconds since 1970.

    ``held_down`` is why a failed node is kept down, and empty otherwise; ``wanted`` is the state
    that it is to be in; ``left_to_manager`` is what is asked of the manager and not of the node
    (see :class:`composer.model.Introspection`); ``starts_active`` is whether a start of the system
    makes it active. Rates are in hertz, over the last second, as is ``busy``: the share of a thread
    that its callbacks took. ``slowest`` is the callback that took longest at once so far, and how
    long; ``overruns`` are calls over their ``budget_ms``, ``queue_drops`` what full queues pushed
    out; ``qos_events`` counts what :mod:`composer.runtime.ports.qos_events` tells of.
    """

    node: str
    wanted: str
    starts_active: bool = True
    left_to_manager: tuple[str, ...] = ()
    state: str = "unconfigured"
    since_s: float = 0.0
    restarts: int = 0
    last_error: str = ""
    held_down: str = ""
    errors: int = 0
    sent_hz: float = 0.0
    received_hz: float = 0.0
    busy: float = 0.0
    slowest: str = ""
    overruns: int = 0
    queue_drops: int = 0
    qos_events: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SystemStatus:
    """A system, its process, and its nodes in the order of the bring-up."""

    system: str
    activity: str  # what is being done with it: "starting", "running", "pausing", "stopping" ...
    nodes: tuple[NodeStatus, ...]
    host: str
    pid: int
    started_s: float  # seconds since 1970

    @property
    def failed(self) -> tuple[NodeStatus, ...]:
        """The nodes that are held down."""
        return tuple(node for node in self.nodes if node.held_down)

    @property
    def is_active(self) -> bool:
        """Whether every node that a start makes active is active, and no node has failed.

        A node that failed counts also where a start only makes it inactive. A system without any
        node that is to be active is not.
        """
        wanted = [node for node in self.nodes if node.starts_active]
        return bool(wanted) and not self.failed and all(node.state == "active" for node in wanted)

    @property
    def summary(self) -> str:
        """The system in one line: ``2 of 3 nodes active, /planner is down: silent for 1 s``."""
        active = sum(node.state == "active" for node in self.nodes)
        parts = [f"{active} of {len(self.nodes)} nodes active"]
        parts += [f"{node.node} is down: {node.held_down}" for node in self.failed]
        return ", ".join(parts)


class _Counters(NamedTuple):
    """What a node had done at a moment of ``time.monotonic()``."""

    at_s: float
    sent: int
    received: int
    busy_s: float

    def put_into(self, node: NodeStatus, before: _Counters | None) -> NodeStatus:
        """Return ``node`` with the rates since ``before``."""
        if before is None or self.at_s <= before.at_s:
            return node
        passed_s = self.at_s - before.at_s
        # A node that was made anew counts from zero again.
        return replace(
            node,
            sent_hz=max(0, self.sent - before.sent) / passed_s,
            received_hz=max(0, self.received - before.received) / passed_s,
            busy=max(0.0, self.busy_s - before.busy_s) / passed_s,
        )


class Status:
    """Where everything that happens to nodes is written down, from any thread."""

    def __init__(self, system: System, order: tuple[str, ...]) -> None:
        """``order`` has the keys of all nodes, in the order of the bring-up."""
        self._lock = threading.Lock()
        self._changed: Callable[[], None] = lambda: None
        self._statistics: Mapping[str, Statistics] = {}
        self._counters: dict[str, _Counters] = {}
        self._counters_before: dict[str, _Counters] = {}
        now_s = time.time()
        models = {node.name.value: node for node in system.nodes}
        goals = start_goals(system, PrimaryState.ACTIVE)
        self._status = SystemStatus(
            system=system.name.value,
            activity="starting",
            nodes=(),
            host=socket.gethostname(),
            pid=os.getpid(),
            started_s=now_s,
        )
        self._nodes = {
            name: NodeStatus(
                models[name].full_name,
                PrimaryState.UNCONFIGURED.value,
                starts_active=goals[name] is PrimaryState.ACTIVE,
                left_to_manager=models[name].introspection.left_to_manager,
                since_s=now_s,
            )
            for name in order
        }

    def on_change(self, changed: Callable[[], None]) -> None:
        """Call ``changed`` after each change, on the thread that made it."""
        self._changed = changed

    @property
    def without_nodes(self) -> SystemStatus:
        """The system and its process: a snapshot for who asks nothing about nodes."""
        return self._status

    def snapshot(self) -> SystemStatus:
        """Return everything as it is now."""
        with self._lock:
            nodes = tuple(self._measured(name, node) for name, node in self._nodes.items())
            return replace(self._status, nodes=nodes)

    def set_activity(self, activity: str) -> None:
        """Say what is being done with the system."""
        with self._lock:
            self._status = replace(self._status, activity=activity)
        self._changed()

    def set_wanted(self, wanted: Mapping[str, str], held_down: Mapping[str, str]) -> None:
        """Say where the nodes are to be, and which failed ones are held down, by their keys."""
        with self._lock:
            for name, node in self._nodes.items():
                self._nodes[name] = replace(
                    node,
                    wanted=wanted.get(name, node.wanted),
                    held_down=held_down.get(name, ""),
                )
        self._changed()

    def set_state(self, name: str, state: str) -> None:
        """Say that a node has come to rest in a state."""
        self._change(name, state=state, since_s=time.time())

    def see_states(self, states: Mapping[str, str]) -> None:
        """Take over the states that nodes are seen in, of which some may be transitions."""
        for name, state in states.items():
            if self._nodes[name].state != state:
                self.set_state(name, state)

    def set_error(self, name: str, text: str) -> None:
        """Say what went wrong with a node last."""
        self._change(name, last_error=text)

    def count_restart(self, name: str) -> None:
        """Count one more restart of a node."""
        with self._lock:
            node = self._nodes[name]
            self._nodes[name] = replace(node, restarts=node.restarts + 1)
        self._changed()

    def measure(self, statistics: Mapping[str, Statistics]) -> None:
        """Take down the counters of the nodes: rates are those since the last time.

        What is made of them is worked out for who asks.
        """
        now_s = time.monotonic()
        with self._lock:
            self._statistics = statistics
            self._counters_before = self._counters
            self._counters = {
                name: _Counters(now_s, counted.sent, counted.received, counted.busy_s)
                for name, counted in statistics.items()
            }

    def _measured(self, name: str, node: NodeStatus) -> NodeStatus:
        counted = self._statistics.get(name)
        if counted is None:
            return node
        node = replace(
            node,
            errors=counted.errors,
            slowest=counted.slowest,
            overruns=counted.overruns,
            queue_drops=counted.queue_drops,
            qos_events=dict(counted.qos_events),
        )
        return self._counters[name].put_into(node, self._counters_before.get(name))

    def _change(self, name: str, **changes: object) -> None:
        with self._lock:
            self._nodes[name] = replace(self._nodes[name], **changes)  # type: ignore[arg-type]
        self._changed()
