"""The status of a running system: what the manager node publishes and answers."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from composer.model import Node, PrimaryState, System
from composer.model.dependencies import in_dependency_order, needed_states
from composer.plan import optional_nodes, start_goals
from composer.runtime.clock import COMPUTER, Clock
from composer.runtime.metrics.figures import CountedRate
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node.managed_node import ManagedNode
from composer.runtime.protocol.reports import NodeReport, SystemReport

#: Characters of a text that user code or another node may have made long.
_MAX_LENGTH = 500


class _NodeRates:
    """The rates of a node in this process, from counters that are read every second."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._sent, self._received = CountedRate(), CountedRate()
        self._at_s = self._busy_s = 0.0
        self._busy: float | None = None

    def read(self, counters: Statistics) -> None:
        """Read the counters."""
        before_s, self._at_s = self._at_s, self._clock.monotonic()
        before_busy_s, self._busy_s = self._busy_s, counters.busy_s

        def time_of(last_s: float) -> float:
            """Return when the last message was counted: the time of a callback since then."""
            return last_s if last_s > before_s else self._at_s

        self._sent.read(counters.sent, time_of(counters.last_sent_s))
        self._received.read(counters.received, time_of(counters.last_received_s))
        if 0.0 < before_s < self._at_s:
            self._busy = max(0.0, self._busy_s - before_busy_s) / (self._at_s - before_s)

    def current(self) -> dict[str, float | None]:
        """Return the rates at the last reading; most of them are never asked for."""
        return {
            "sent_hz": self._sent.current_hz(self._at_s),
            "received_hz": self._received.current_hz(self._at_s),
            "busy": self._busy,
        }


class Status:
    """The current status of the system and its nodes. Thread-safe."""

    def __init__(self, system: System, clock: Clock, *, is_child: bool = False) -> None:
        #: The clock of the system.
        self.clock = clock
        self._lock = threading.Lock()
        self._changed: Callable[[], None] = lambda: None
        #: The counters of each node, and what is known of those outside the process.
        self._measured: Mapping[str, tuple[Statistics, Mapping[str, Any]]] = {}
        now_s = COMPUTER.time()  # as the readers of reports have it
        models = {node.name.value: node for node in system.nodes}
        self._rates = {name: _NodeRates(clock) for name, node in models.items() if node.in_process}
        self._topics = {
            name: {port.name.value: port.full_name for port in node.ports}
            for name, node in models.items()
        }
        goals, optional = start_goals(system, PrimaryState.ACTIVE), optional_nodes(system)
        needed = needed_states(system)
        self._status = SystemReport(
            name=system.name.value,
            activity="starting",
            nodes=(),
            host=socket.gethostname(),
            pid=str(os.getpid()),
            started_s=now_s,
            is_child=is_child,
        )
        self._nodes = {
            name: NodeReport(
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
    def without_nodes(self) -> SystemReport:
        """The status of the system and its process, without its nodes."""
        return self._status

    def snapshot(self) -> SystemReport:
        """Return the status now."""
        with self._lock:
            nodes = tuple(self._with_counters(name, node) for name, node in self._nodes.items())
            return replace(self._status, nodes=nodes)

    def set_activity(self, activity: str) -> None:
        """Set the activity of the system."""
        with self._lock:
            self._status = replace(self._status, activity=activity)
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
                    held_down=_cut(held_down.get(name, "")),
                    condition=conditions.get(name, ""),
                )
                is_changed = is_changed or node != before
        if is_changed:
            self._changed()

    def set_state(self, name: str, state: str) -> None:
        """Set the state of a node."""
        self._change(name, state=state, since_s=COMPUTER.time())

    def update_states(self, states: Mapping[str, str]) -> None:
        """Set observed states, which may also be transition states."""
        for name, state in states.items():
            if self._nodes[name].state != state:
                self.set_state(name, state)

    def set_error(self, name: str, text: str) -> None:
        """Set the last error of a node."""
        self._change(name, last_error=_cut(text))

    def count_restart(self, name: str) -> None:
        """Count one more restart of a node."""
        with self._lock:
            node = self._nodes[name]
            self._nodes[name] = replace(node, restarts=node.restarts + 1)
        self._changed()

    def measure(self, nodes: Mapping[str, ManagedNode]) -> None:
        """Read the counters of nodes, by their keys."""
        with self._lock:
            self._measured = {name: (node.statistics, node.figures) for name, node in nodes.items()}
            for name, rates in self._rates.items():
                if name in nodes:
                    rates.read(nodes[name].statistics)

    def _with_counters(self, name: str, node: NodeReport) -> NodeReport:
        if name not in self._measured:
            return node
        counters, reported = self._measured[name]
        counted = self._counted(name, node, counters)
        return replace(counted, **reported) if reported else counted

    def _counted(self, name: str, node: NodeReport, counters: Statistics) -> NodeReport:
        rates = self._rates[name].current() if name in self._rates else {}
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


def _cut(text: str) -> str:
    return text if len(text) <= _MAX_LENGTH else f"{text[:_MAX_LENGTH]}..."


def _process_of(node: Node) -> str:
    return "" if node.process is None else node.process.value
