"""What is known of a running system at a moment: for the manager node, and whoever asks it."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from composer.model import PrimaryState, System
from composer.plan import start_goals
from composer.runtime.statistics import Statistics


@dataclass(frozen=True, slots=True)
class NodeStatus:
    """One node. ``since_s`` is when it came into its state, in seconds since 1970.

    ``held_down`` is why a failed node is kept down, and empty otherwise; ``wanted`` is the state
    that it is to be in; ``left_to_manager`` is what is asked of the manager and not of the node
    (see :class:`composer.model.Introspection`); ``starts_active`` is whether a start of the system
    makes it active. Rates are in hertz, over the last second, as is ``busy``: the share of a thread
    that its callbacks took. ``slowest`` is the callback that took longest at once so far, and how
    long; ``overruns`` are calls over their ``budget_ms``, ``queue_drops`` what full queues pushed
    out.
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
        """Whether every node that a start makes active is active."""
        return all(node.state == "active" for node in self.nodes if node.starts_active)

    @property
    def summary(self) -> str:
        """The system in one line: ``2 of 3 nodes active, /planner is down: silent for 1 s``."""
        active = sum(node.state == "active" for node in self.nodes)
        parts = [f"{active} of {len(self.nodes)} nodes active"]
        parts += [f"{node.node} is down: {node.held_down}" for node in self.failed]
        return ", ".join(parts)


class Board:
    """Where everything that happens to nodes is written down, from any thread."""

    def __init__(self, system: System, order: tuple[str, ...]) -> None:
        """``order`` has the keys of all nodes, in the order of the bring-up."""
        self._lock = threading.Lock()
        self._changed: Callable[[], None] = lambda: None
        self._counters: dict[str, tuple[float, int, int, float]] = {}
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

    def snapshot(self) -> SystemStatus:
        """Return everything as it is now."""
        with self._lock:
            return replace(self._status, nodes=tuple(self._nodes.values()))

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
        """Work out the rates since the last time from the counters of the nodes."""
        now_s = time.monotonic()
        with self._lock:
            for name, counted in statistics.items():
                before = self._counters.get(name)
                busy_s = counted.busy_s
                self._counters[name] = (now_s, counted.sent, counted.received, busy_s)
                node = replace(
                    self._nodes[name],
                    errors=counted.errors,
                    slowest=counted.slowest,
                    overruns=counted.overruns,
                    queue_drops=counted.queue_drops,
                )
                if before is not None and now_s > before[0]:
                    passed_s = now_s - before[0]
                    # A node that was made anew counts from zero again.
                    node = replace(
                        node,
                        sent_hz=max(0, counted.sent - before[1]) / passed_s,
                        received_hz=max(0, counted.received - before[2]) / passed_s,
                        busy=max(0.0, busy_s - before[3]) / passed_s,
                    )
                self._nodes[name] = node

    def _change(self, name: str, **changes: object) -> None:
        with self._lock:
            self._nodes[name] = replace(self._nodes[name], **changes)  # type: ignore[arg-type]
        self._changed()
