"""``nodes``: all nodes and running systems, with their states and figures."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.messages import Values, to_json
from composer.dashboard.observing.processes import ProcessMonitor
from composer.dashboard.outbox import Update

if TYPE_CHECKING:
    from composer.dashboard.ros_side import RosGraphSide
    from composer.remote.system_reports import NodeReport, SystemReport

_PERIOD_S = 1.0
COMMANDS = ("startup", "pause", "resume", "reset", "shutdown")
_TRANSITIONS = {
    "unconfigured": ["configure", "shutdown"],
    "inactive": ["activate", "cleanup", "shutdown"],
    "active": ["deactivate", "shutdown"],
}
#: Counts of messages by topic are for the graph.
_NOT_SHOWN = ("node", "sent", "received", "dropped")


class NodesFeed(Feed):
    """All nodes, once a second and soon after a change."""

    period_s = 0.25

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises BadRequestError."""
        values.end()
        self._declared = declared
        self._ros: RosGraphSide
        self._host = socket.gethostname()
        self._processes = ProcessMonitor()
        self._usage: dict[str, dict[str, Any] | None] = {}
        self._due_s = 0.0
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
        observed = self._ros.observed
        reports = observed.reports.current()
        nodes: dict[str, dict[str, Any]] = {}
        for name, report in reports.items():
            if report is not None:
                nodes |= {node.node: self._managed(name, node) for node in report.nodes}
        for node, state in observed.states().items():
            nodes.setdefault(node, self._other(node, state))
        for node in observed.topology().visible:
            nodes.setdefault(node, self._other(node, ""))
        states = [(name, node["state"], node.get("held_down")) for name, node in nodes.items()]
        activities = [(name, report and report.activity) for name, report in reports.items()]
        now_s = time.monotonic()
        if (states, activities) == self._last and now_s < self._due_s:
            return
        self._last, self._due_s = (states, activities), now_s + _PERIOD_S
        self._usage = {
            report.pid: self._processes.usage(report.pid)
            for report in reports.values()
            if report is not None and report.host == self._host
        }
        systems = [self._system(name, report) for name, report in sorted(reports.items())]
        yield Update(to_json({"systems": systems, "nodes": list(nodes.values())}))

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
            "process": None if report is None else self._usage.get(report.pid),
            "commands": list(COMMANDS),
            "file": declared.file if declared is not None and is_declared else None,
        }

    def _managed(self, system: str, node: NodeReport) -> dict[str, Any]:
        values = {key: value for key, value in asdict(node).items() if key not in _NOT_SHOWN}
        return {
            "name": node.node,
            "system": system,
            **values,
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
