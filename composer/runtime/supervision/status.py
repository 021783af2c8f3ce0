"""The status of a running system: what the manager node publishes and answers."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.model import Node, PrimaryState, System
from composer.model.dependencies import in_dependency_order, needed_states
from composer.plan import STARTING, Condition, optional_nodes, parse_goals, start_goals
from composer.runtime.metrics.message_rate import CountedRate
from composer.runtime.metrics.statistics import Statistics

_MAX_LISTED = 5


@dataclass(frozen=True, slots=True)
class NodeStatus:
    """The status of one node.

    ``desired`` is the state that the supervisor keeps it in; ``since_s`` is when it reached its
    state, in seconds since 1970. ``held_down`` is why a failed node is held down, else empty;
    ``condition`` says in words what becomes of it, or what it waits for. ``is_required`` is whether
    the system needs it, ``is_optional`` whether the system is up without it: it is not required, or
    depends on such a node. ``starts_active`` is whether a start of the system activates it.
    ``depends_on`` are the states
    that the nodes it depends on must have, by their full names. ``left_to_manager`` are the
    services that the manager node has instead (see :class:`composer.model.Introspection`).
    ``process`` is the process of the system that the node runs in, empty for the one that reports.
    ``pid`` is the id of the operating system's process, empty while none runs or it is not known,
    and ``host`` its computer, empty for that of the process that reports.

    Rates are in hertz from burst to burst of the last seconds; ``busy`` is the share of a thread
    that its callbacks took in the last second. They are None if they are not known, as of an
    executable. ``slowest`` is the
    callback with the longest call so far, and its time. ``calls`` and ``skipped`` are as in a
    ``NodeSummary``.
    ``overruns`` counts calls over their ``budget_ms``, ``queue_drops`` messages and calls that full
    queues dropped, ``qos_events`` the events of :mod:`composer.runtime.ports.qos_events` by name.
    ``sent``, ``received`` and ``dropped`` count messages by topic.
    """

    node: str
    desired: str
    starts_active: bool = True
    is_required: bool = True
    is_optional: bool = False
    depends_on: Mapping[str, str] = field(default_factory=dict)
    left_to_manager: tuple[str, ...] = ()
    process: str = ""
    host: str = ""
    pid: str = ""
    state: str = "unconfigured"
    since_s: float = 0.0
    restarts: int = 0
    last_error: str = ""
    held_down: str = ""
    condition: str = ""
    errors: int = 0
    sent_hz: float | None = None
    received_hz: float | None = None
    busy: float | None = None
    slowest: str = ""
    overruns: int = 0
    queue_drops: int = 0
    calls: int = 0
    skipped: int = 0
    qos_events: Mapping[str, int] = field(default_factory=dict)
    sent: Mapping[str, int] = field(default_factory=dict)
    received: Mapping[str, int] = field(default_factory=dict)
    dropped: Mapping[str, int] = field(default_factory=dict)

    @property
    def counts(self) -> bool:
        """Whether the system is not up without the node."""
        return not self.is_optional and self.condition != Condition.IGNORED


@dataclass(frozen=True, slots=True)
class SystemStatus:
    """A system, its process, and its nodes in the order of the bring-up.

    ``is_child`` is whether the coordinating process of the system has started this one. ``goals``
    are those of the whole system: see :mod:`composer.plan.transitions`.
    """

    system: str
    activity: str  # "starting", "running", "pausing", "stopping" ...
    nodes: tuple[NodeStatus, ...]
    host: str
    pid: int
    started_s: float  # seconds since 1970
    is_child: bool = False
    goals: str = ""

    @property
    def failed(self) -> tuple[NodeStatus, ...]:
        """The nodes that are held down, and that the system needs."""
        return tuple(node for node in self.nodes if node.held_down and node.is_required)

    @property
    def is_active(self) -> bool:
        """Whether every node that a start activates is active, and no node has failed.

        Optional nodes, and those whose failure is ignored, do not count. A system in which a start
        activates no node is never active.
        """
        nodes = [node for node in self.nodes if node.starts_active]
        are_active = all(node.state == "active" for node in nodes if node.counts)
        return bool(nodes) and not self.failed and are_active

    @property
    def is_ready(self) -> bool:
        """Whether it is up: as ``is_active``, and no node is in another state than desired.

        A system in which a start activates no node is ready if it runs.
        """
        active = self.is_active or not any(node.starts_active for node in self.nodes)
        settled = all(node.state == node.desired for node in self.nodes if node.counts)
        return self.activity == "running" and active and not self.failed and settled

    @property
    def remarks(self) -> tuple[str, ...]:
        """What keeps nodes from being up, in words."""
        missing = (Condition.ABSENT, STARTING)
        absent = [node.node for node in self.nodes if node.condition in missing]
        down = [node for node in self.nodes if node.held_down and node.node not in absent]
        waiting = [f"waiting for {_listed(absent)}"] if absent else []
        failed = [f"{node.node} is {node.condition or 'down'}: {node.held_down}" for node in down]
        more = [f"{len(down) - _MAX_LISTED} more are down"] if len(down) > _MAX_LISTED else []
        return (*waiting, *failed[:_MAX_LISTED], *more)

    @property
    def active(self) -> int:
        """The number of active nodes."""
        return sum(node.state == "active" for node in self.nodes)

    @property
    def summary(self) -> str:
        """The system in one line: ``2 of 3 nodes active, /planner is isolated: no map``."""
        return ", ".join((f"{self.active} of {len(self.nodes)} nodes active", *self.remarks))


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MAX_LISTED} more" if len(names) > _MAX_LISTED else ""
    return f"{', '.join(names[:_MAX_LISTED])}{more}"


class _NodeRates:
    """The rates of a node in this process, from counters that are read every second."""

    def __init__(self) -> None:
        self._sent, self._received = CountedRate(), CountedRate()
        self._at_s = self._busy_s = 0.0
        self.current: dict[str, float | None] = {}

    def read(self, counters: Statistics) -> None:
        """Read the counters."""
        before_s, self._at_s = self._at_s, time.monotonic()
        before_busy_s, self._busy_s = self._busy_s, counters.busy_s

        def time_of(last_s: float) -> float:
            """Return when the last message was counted: the time of a callback since then."""
            return last_s if last_s > before_s else self._at_s

        self._sent.read(counters.sent, time_of(counters.last_sent_s))
        self._received.read(counters.received, time_of(counters.last_received_s))
        passed_s = self._at_s - before_s
        self.current = {
            "sent_hz": self._sent.current_hz(self._at_s),
            "received_hz": self._received.current_hz(self._at_s),
            "busy": max(0.0, self._busy_s - before_busy_s) / passed_s if before_s else None,
        }


class Status:
    """The current status of the system and its nodes. Thread-safe."""

    def __init__(self, system: System, *, is_child: bool = False) -> None:
        self._lock = threading.Lock()
        self._changed: Callable[[], None] = lambda: None
        self._statistics: Mapping[str, Statistics] = {}
        self._reported: Mapping[str, Mapping[str, Any]] = {}
        now_s = time.time()
        models = {node.name.value: node for node in system.nodes}
        self._rates = {name: _NodeRates() for name, node in models.items() if node.in_process}
        self._topics = {
            name: {port.name.value: port.full_name for port in node.ports}
            for name, node in models.items()
        }
        goals, optional = start_goals(system, PrimaryState.ACTIVE), optional_nodes(system)
        needed = needed_states(system)
        self._status = SystemStatus(
            system=system.name.value,
            activity="starting",
            nodes=(),
            host=socket.gethostname(),
            pid=os.getpid(),
            started_s=now_s,
            is_child=is_child,
        )
        self._nodes = {
            name: NodeStatus(
                models[name].full_name,
                PrimaryState.UNCONFIGURED.value,
                starts_active=goals[name] is PrimaryState.ACTIVE,
                is_required=models[name].required,
                is_optional=name in optional,
                depends_on={
                    models[on].full_name: state.value for on, state in needed[name].items()
                },
                left_to_manager=models[name].introspection.left_to_manager,
                process=_process_of(models[name]),
                pid=str(os.getpid()) if models[name].in_process else "",
                since_s=now_s,
            )
            for name in in_dependency_order(system)
        }

    def on_change(self, changed: Callable[[], None]) -> None:
        """Call ``changed`` after each change, on the thread of the change."""
        self._changed = changed

    @property
    def without_nodes(self) -> SystemStatus:
        """The status of the system and its process, without its nodes."""
        return self._status

    def snapshot(self) -> SystemStatus:
        """Return the status now."""
        with self._lock:
            nodes = tuple(self._with_counters(name, node) for name, node in self._nodes.items())
            return replace(self._status, nodes=nodes)

    def set_activity(self, activity: str) -> None:
        """Set the activity of the system."""
        with self._lock:
            self._status = replace(self._status, activity=activity)
        self._changed()

    def keep_goals(self, text: str) -> None:
        """Keep the goals of the whole system, unless there are newer ones."""
        new = parse_goals(text)
        with self._lock:
            known = parse_goals(self._status.goals)
            if new is None or (known is not None and new.serial <= known.serial):
                return
            self._status = replace(self._status, goals=text)
        self._changed()

    def set_desired(
        self,
        desired: Mapping[str, str],
        held_down: Mapping[str, str],
        conditions: Mapping[str, str],
    ) -> None:
        """Set the desired states, why failed nodes are held down, and conditions, by their keys."""
        is_changed = False
        with self._lock:
            for name, before in self._nodes.items():
                self._nodes[name] = node = replace(
                    before,
                    desired=desired.get(name, before.desired),
                    held_down=held_down.get(name, ""),
                    condition=conditions.get(name, ""),
                )
                is_changed = is_changed or node != before
        if is_changed:
            self._changed()

    def set_state(self, name: str, state: str) -> None:
        """Set the state of a node."""
        self._change(name, state=state, since_s=time.time())

    def update_states(self, states: Mapping[str, str]) -> None:
        """Set observed states, which may also be transition states."""
        for name, state in states.items():
            if self._nodes[name].state != state:
                self.set_state(name, state)

    def set_error(self, name: str, text: str) -> None:
        """Set the last error of a node."""
        self._change(name, last_error=text)

    def count_restart(self, name: str) -> None:
        """Count one more restart of a node."""
        with self._lock:
            node = self._nodes[name]
            self._nodes[name] = replace(node, restarts=node.restarts + 1)
        self._changed()

    def measure(
        self,
        statistics: Mapping[str, Statistics],
        reported: Mapping[str, Mapping[str, Any]] | None = None,
    ) -> None:
        """Read the counters of the nodes for their rates.

        ``reported`` is what is known of nodes outside the process, by fields of ``NodeStatus``.
        """
        with self._lock:
            self._statistics = statistics
            self._reported = reported or {}
            for name, rates in self._rates.items():
                if name in statistics:
                    rates.read(statistics[name])

    def _with_counters(self, name: str, node: NodeStatus) -> NodeStatus:
        counters = self._statistics.get(name)
        if counters is not None:
            node = self._counted(name, node, counters)
        reported = self._reported.get(name)
        return replace(node, **reported) if reported else node

    def _counted(self, name: str, node: NodeStatus, counters: Statistics) -> NodeStatus:
        rates = self._rates[name].current if name in self._rates else {}
        return replace(
            node,
            **rates,  # type: ignore[arg-type]  # of fields that are floats
            errors=counters.errors,
            slowest=counters.slowest,
            overruns=counters.overruns,
            queue_drops=counters.queue_drops,
            calls=counters.calls,
            skipped=counters.skipped,
            qos_events=dict(counters.qos_events),
            sent=self._by_topic(name, counters.sent_by_port),
            received=self._by_topic(name, counters.received_by_port),
            dropped=self._by_topic(name, counters.dropped_by_port),
        )

    def _by_topic(self, name: str, counts: Mapping[str, int]) -> Mapping[str, int]:
        found: dict[str, int] = {}
        topics = self._topics[name]
        for port, count in counts.items():
            topic = topics.get(port, port)
            found[topic] = found.get(topic, 0) + count
        return found

    def _change(self, name: str, **changes: object) -> None:
        with self._lock:
            self._nodes[name] = replace(self._nodes[name], **changes)  # type: ignore[arg-type]
        self._changed()


def _process_of(node: Node) -> str:
    return "" if node.process is None else node.process.value
