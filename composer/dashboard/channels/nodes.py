"""``nodes``: all nodes and running systems, with their states and figures."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.observing.processes import ProcessMonitor, total
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Update

if TYPE_CHECKING:
    from composer.client.systems.system_reports import NodeReport, SystemReport
    from composer.dashboard.ros_side import RosGraphSide

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
_TRANSITIONS = {
    "unconfigured": ["configure", "shutdown"],
    "inactive": ["activate", "cleanup", "shutdown"],
    "active": ["deactivate", "shutdown"],
}
#: What is shown of a report. Counts of messages by topic are for the graph.
_SHOWN = (
    *("state", "desired", "since_s", "restarts", "errors", "last_error", "held_down", "condition"),
    *("sent_hz", "received_hz", "busy", "slowest", "overruns", "queue_drops", "qos_events"),
    *("depends_on", "process", "host", "pid"),
)


class NodesFeed(Feed):
    """All nodes, once a second and soon after a change."""

    follows_reports = True

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises BadRequestError."""
        values.end()
        self._declared = declared
        self._ros: RosGraphSide
        self._host = socket.gethostname()
        self._processes = ProcessMonitor()
        self._usage: dict[str, dict[str, Any] | None] = {}
        self._due_s = self._usage_due_s = 0.0
        self._last: Any = None

    def start(self, ros: RosGraphSide) -> None:
        """Subscribe to the reports of systems."""
        self._ros = ros
        ros.observed.reports.acquire()

    def close(self) -> None:
        """Unsubscribe."""
        self._ros.observed.reports.release()

    def poll(self) -> Iterator[Update]:
        """Yield all nodes and systems if anything is new."""
        from composer.client.systems.system_reports import of_whole_systems

        observed = self._ros.observed
        self.period_s = _SOON_S if observed.is_new else _PERIOD_S
        reports = of_whole_systems(observed.reports.current())
        managed = {
            node.node: (name, node)
            for name, report in reports.items()
            if report is not None
            for node in report.nodes
        }
        states = dict.fromkeys(observed.topology().visible, "") | observed.states()
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
            "transitions": _TRANSITIONS.get(node.state, []),
            "declared_at": self._declared_at(node.node),
        }

    def _other(self, node: str, state: str | None) -> dict[str, Any]:
        return {
            "name": node,
            "system": None,
            "state": state,
            "transitions": _TRANSITIONS.get(state or "", []),
            "declared_at": self._declared_at(node),
        }

    def _declared_at(self, node: str) -> str | None:
        return None if self._declared is None else self._declared.declared_at(node)
