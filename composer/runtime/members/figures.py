"""What a process of the system reports of its nodes: rates, and counters over all of its lives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from composer.runtime.protocol.reports import NodeReport

#: Processes report every second. One that has not reported for this time is lost.
REPORTS_WITHIN_S = 5.0
_COUNTS = ("errors", "overruns", "queue_drops", "calls", "skipped")
_COUNTS_BY_NAME = ("sent", "received", "dropped", "qos_events")
_FIGURES = ("sent_hz", "received_hz", "busy", "slowest", "host", "pid", *_COUNTS, *_COUNTS_BY_NAME)


class NodeFigures:
    """The rates and counters of a node over all lives of its process, which count from zero."""

    def __init__(self) -> None:
        self._reported: dict[str, Any] = {}
        self._counts: Counter[str] = Counter()  # of the last report
        self._earlier: Counter[str] = Counter()  # counted by earlier lives
        self._known = False
        self._before: Counter[str] = Counter()  # counted before this process was there

    def take(self, node: NodeReport, host: str, *, is_started_here: bool) -> None:
        """Receive what the process, on a host, reports of the node."""
        self._reported = {name: getattr(node, name) for name in _FIGURES}
        self._reported["host"] = node.host or host
        self._counts = Counter({name: getattr(node, name) for name in _COUNTS})
        for name in _COUNTS_BY_NAME:
            self._counts[name] = sum(getattr(node, name).values())
        if not self._known:
            self._known = True
            self._before = Counter() if is_started_here else self._counts

    def end_life(self) -> None:
        """Keep the counts of a process that has ended."""
        self._earlier += self._counts
        self._reported = {}
        self._counts = Counter()

    @property
    def current(self) -> Mapping[str, Any]:
        """The figures by the names of the fields of ``NodeReport``, of all lives so far."""
        totals = {name: self._counts[name] + self._earlier[name] for name in _COUNTS}
        return {**self._reported, **totals}

    @property
    def since_start(self) -> Mapping[str, int]:
        """The counters since this process knows the node."""
        return self._counts + self._earlier - self._before
