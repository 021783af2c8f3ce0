"""``nodes``: states and figures; ``timing``: callbacks and chains; ``parameters`` of one node."""

from __future__ import annotations

import socket
import threading
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from composer.dashboard.context import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import RequestError, Values, from_ros, json_safe, to_json
from composer.dashboard.protocol.outbox import Update
from composer.model.lifecycle import available_transitions
from composer.model.qos import QosProfile
from composer.runtime.process.computer import ProcessUsage, process_usage

if TYPE_CHECKING:
    from composer.client.shared_session import SampledTopic
    from composer.runtime.metrics.figures import CallbackRates
    from composer.runtime.protocol.reports import NodeReport, SystemReport


_PERIOD_S = 1.0
#: While nodes are being discovered.
_SOON_S = 0.25
#: Linux counts the CPU time in steps of 10 ms, so a longer time is also more precise.
_USAGE_PERIOD_S = 1.8
#: Without a second measurement, there is no CPU time to show.
_FIRST_USAGE_PERIOD_S = 0.8
#: Reports arrive a little earlier or later than after a second.
_EARLY = 0.8
COMMANDS = ("startup", "pause", "resume", "reset", "shutdown")
#: What is shown of a report. Counts of messages by topic are for the graph.
_SHOWN = (
    *("state", "desired", "since_s", "restarts", "errors", "last_error", "held_down", "condition"),
    *("sent_hz", "received_hz", "busy", "slowest", "overruns", "queue_drops", "qos_events"),
    *("depends_on", "process", "host", "pid"),
)
_MS = 1e3
_EVENTS = "/parameter_events"
_EVENTS_TYPE = "rcl_interfaces/msg/ParameterEvent"
#: Events that may wait.
_MAX_EVENTS = 1000
_READ_PERIOD_S = 2.0
_READ_WITHIN_S = 3.0


class NodesFeed(Feed):
    """All nodes, once a second and soon after a change."""

    follows_reports = True

    def __init__(self, _: Values, declared: Declared | None) -> None:
        self._declared = declared
        self._host = socket.gethostname()
        self._processes = ProcessMonitor()
        self._usage: dict[str, dict[str, Any] | None] = {}
        self._due_s = self._usage_due_s = 0.0
        self._last: Any = None

    def start(self) -> None:
        """Subscribe to the reports of systems."""
        self.resources.enter_context(self.ros.reports.used())

    def poll(self) -> Iterator[Update]:
        """Yield all nodes and systems if anything is new."""
        from composer.client.systems.local_queries import of_whole_systems

        ros = self.ros
        self.period_s = _SOON_S if ros.is_new else _PERIOD_S
        reports = of_whole_systems(ros.reports.current())
        managed = {
            node.node: (name, node)
            for name, report in reports.items()
            if report is not None
            for node in report.nodes
        }
        states = dict.fromkeys(ros.topology().visible, "") | ros.states()
        held_down = [(node.held_down, node.condition) for _, node in managed.values()]
        activities = [(name, report and report.activity) for name, report in reports.items()]
        now_s = time.monotonic()
        if (states, held_down, activities) == self._last and now_s < self._due_s:
            return
        self._last, self._due_s = (states, held_down, activities), now_s + _PERIOD_S * _EARLY
        if now_s >= self._usage_due_s:
            is_first = not self._usage
            self._usage_due_s = now_s + (_FIRST_USAGE_PERIOD_S if is_first else _USAGE_PERIOD_S)
            self._usage = self._measured(reports.values())
        nodes = [self._managed(name, node) for name, node in managed.values()]
        nodes += [self._other(*item) for item in states.items() if item[0] not in managed]
        systems = [self._system(name, report) for name, report in sorted(reports.items())]
        yield Update(to_json({"host": self._host, "systems": systems, "nodes": nodes}))

    def _measured(self, reports: Iterable[SystemReport | None]) -> dict[str, Any]:
        """Return the usage of the processes on this computer by their ids."""
        pids = {pid for report in reports if report is not None for pid in self._local(report)}
        return {pid: self._processes.usage(pid) for pid in pids}

    def _local(self, report: SystemReport) -> set[str]:
        """Return the ids of the processes of a system on this computer."""
        places = {(node.host, node.pid) for node in report.nodes} | {(report.host, report.pid)}
        return {pid for host, pid in places if host == self._host and pid}

    def _system(self, name: str, report: SystemReport | None) -> dict[str, Any]:
        declared = self._declared
        is_declared = declared is not None and declared.is_of(name)
        return {
            "name": name,
            "answers": report is not None,
            "activity": "" if report is None else report.activity,
            "message": "it does not respond" if report is None else report.message,
            "host": "" if report is None else report.host,
            "pid": "" if report is None else report.pid,
            "process": None if report is None else total(map(self._usage.get, self._local(report))),
            "commands": list(COMMANDS),
            "file": declared.file if declared is not None and is_declared else None,
        }

    def _managed(self, system: str, node: NodeReport) -> dict[str, Any]:
        return {
            "name": node.node,
            "system": system,
            **{key: getattr(node, key) for key in _SHOWN},
            "usage": self._usage.get(node.pid) if node.host == self._host else None,
            "transitions": list(available_transitions(node.state)),
            "declared_at": self._declared_at(node.node),
        }

    def _other(self, node: str, state: str | None) -> dict[str, Any]:
        return {
            "name": node,
            "system": None,
            "state": state,
            "transitions": list(available_transitions(state or "")),
            "declared_at": self._declared_at(node),
        }

    def _declared_at(self, node: str) -> str | None:
        return None if self._declared is None else self._declared.declared_at(node)


def total(usages: Iterable[Mapping[str, Any] | None]) -> dict[str, Any] | None:
    """Return the usage of several processes together, None if none of them runs."""
    known = [usage for usage in usages if usage is not None]
    if not known:
        return None
    percents = [usage["cpu_percent"] for usage in known]
    return {
        "cpu_percent": None if None in percents else round(sum(percents), 1),
        "memory_mb": round(sum(usage["memory_mb"] for usage in known), 1),
        "threads": sum(usage["threads"] for usage in known),
        "up_s": max(usage["up_s"] for usage in known),
        "processes": len(known),
    }


class ProcessMonitor:
    """The use of the processors by processes, between two calls."""

    def __init__(self) -> None:
        self._before: dict[str, ProcessUsage] = {}

    def usage(self, pid: str) -> dict[str, Any] | None:
        """Return the usage of a process; None if there is no such process.

        ``cpu_percent`` is the share of one processor since the last call, None at the first.
        """
        reading = process_usage(pid) if pid.isascii() and pid.isdigit() else None
        if reading is None:
            self._before.pop(pid, None)
            return None
        before, self._before[pid] = self._before.get(pid), reading
        percent = None
        if before is not None and reading.at_s > before.at_s:
            used_s = max(0.0, reading.cpu_s - before.cpu_s)
            percent = round(100.0 * used_s / (reading.at_s - before.at_s), 1)
        return {
            "cpu_percent": percent,
            "memory_mb": round(reading.memory_mb, 1),
            "threads": reading.threads,
            "up_s": round(reading.up_s, 1),
        }


class TimingFeed(Feed):
    """Timings once a second."""

    def __init__(self, _: Values, __: Declared | None) -> None:
        from composer.runtime.metrics.figures import CallbackMeter

        self._meters: defaultdict[str, CallbackMeter] = defaultdict(CallbackMeter)

    def start(self) -> None:
        """Subscribe to the timings."""
        self.resources.enter_context(self.ros.reports.used(callbacks=True))

    def poll(self) -> Iterator[Update]:
        """Yield the timings of all systems."""
        reports = self.ros.reports.current()
        with_timings = [
            self._system(name, report)
            for name, report in reports.items()
            if report and report.callbacks_at_s
        ]
        for name in self._meters.keys() - reports.keys():
            del self._meters[name]
        yield Update(to_json({"systems": with_timings}))

    def _system(self, name: str, report: SystemReport) -> dict[str, Any]:
        found = self._meters[name].read(report.callbacks, report.callbacks_at_s)
        return {
            "name": report.name,
            "time": report.callbacks_at_s,
            "chains": [asdict(chain) for chain in report.chains],
            "callbacks": [_callback(item) for item in found],
        }


def _callback(item: CallbackRates) -> dict[str, Any]:
    from composer.runtime.metrics.statistics import parse_buckets

    return {
        **asdict(item.figures),
        "calls_hz": item.calls_hz,
        "busy": item.busy,
        "histogram": [
            [round(bound_s * _MS, 7), count]
            for bound_s, count in parse_buckets(item.figures.histogram)
        ],
    }


class ParametersFeed(Feed):
    """All parameters of a node, again when one has changed.

    They are read on a worker thread, every two seconds and when the node announces a change.
    """

    period_s = 0.1

    def __init__(self, values: Values, declared: Declared | None) -> None:
        self._node = values.text("node")
        self._declared = {} if declared is None else declared.parameters.get(self._node, {})
        self._events: SampledTopic
        self._lock = threading.Lock()
        self._due_s = 0.0
        self._is_reading = False
        self._found: str | RequestError | None = None
        self._last = ""

    def start(self) -> None:
        """Subscribe to announcements of changes."""
        profile = QosProfile(depth=_MAX_EVENTS)
        self._events = self.ros.session.sample(_EVENTS, _EVENTS_TYPE, profile)
        self.resources.callback(self._events.close)

    def poll(self) -> Iterator[Update]:
        """Yield all parameters if any has changed."""
        events = self._events.take(_MAX_EVENTS)
        now_s = time.monotonic()
        if any(event.content.node == self._node for event in events):
            self._due_s = now_s
        if now_s >= self._due_s and not self._is_reading:
            self._due_s = now_s + _READ_PERIOD_S
            self._is_reading = True
            self.ros.work(self._read)
        with self._lock:
            found, self._found = self._found, None
        if isinstance(found, RequestError):
            raise found
        if found is not None and found != self._last:
            self._last = found
            yield Update(found)

    def _read(self) -> None:
        from composer.client.parameters import ParameterClient
        from composer.client.session import Deadline, RosError

        found: str | RequestError
        try:
            deadline = Deadline(_READ_WITHIN_S)
            with closing(ParameterClient(self.ros.session, deadline, self._node)) as client:
                names = client.names()
                descriptions, values = client.describe(names), client.values(names)
            parameters = [self._parameter(asdict(item), values[item.name]) for item in descriptions]
            found = to_json({"node": client.node, "parameters": parameters})
        except RosError as error:
            found = from_ros(error)
        finally:
            self._is_reading = False
        with self._lock:
            self._found = found

    def _parameter(self, described: dict[str, Any], value: Any) -> dict[str, Any]:
        declared = self._declared.get(described["name"])
        found = {**described, "value": json_safe(value), "unit": ""}
        if declared is None:
            return {**found, "declared": None, "declared_at": None, "choices": None}
        return {
            **found,
            "unit": declared.unit,
            "declared": None if declared.value is None else json_safe(declared.value.value),
            "declared_at": str(declared.span),
            "choices": None if declared.choices is None else json_safe(declared.choices.value),
        }
