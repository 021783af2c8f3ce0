"""What a process of the system reports about itself and its nodes.

Its manager node publishes that as a diagnostic_msgs/msg/DiagnosticArray, latched on ``state``. The
process may be of another version.

Any node can publish on ``state``, and a replayed bag does. So the frame id of a report is its
signature. The coordinating process gives the key to those that it starts. It reads the key of
others in their instance locks or, from other computers, asks their services for it.
"""

from __future__ import annotations

import hmac
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.runtime.ros.diagnostic_arrays import Status, finite, optional, read_array, write_array

#: Processes report every second. One that has not reported for this time is lost.
REPORTS_WITHIN_S = 5.0
_RATES = ("sent_hz", "received_hz", "busy")
_COUNTS = ("errors", "overruns", "queue_drops", "calls", "skipped")
_COUNTS_BY_NAME = ("sent", "received", "dropped", "qos_events")
_DIGEST = "sha256"
_DIGITS = 64
#: The signature follows the header, the time and the length of the frame id. Other middleware may
#: change the header.
_HEADER, _SIGNATURE_AT = 4, 16
_SIGNATURE_END = _SIGNATURE_AT + _DIGITS
_ALIGNED = 4  # to so many bytes


@dataclass(frozen=True, slots=True)
class MemberState:
    """A node as its process reports it: its state, and why it is held down, if it has failed.

    ``figures`` are rates, counters and the operating system's process, by the names of the fields
    of ``NodeStatus``.
    """

    state: str
    held_down: str
    figures: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class MemberReport:
    """One report. ``is_child`` is whether a coordinating process has started the process.

    ``number`` counts the reports of the process. ``last_step`` identifies the last step that was
    received: see :meth:`received`. ``goals`` are those of the whole system that it
    keeps. ``host``, ``pid`` and ``started_s`` (seconds since 1970) are those of the process, and
    ``participant`` is the prefix of the ids of its endpoints, in hexadecimal digits.
    """

    activity: str
    host: str
    pid: str
    started_s: float
    is_child: bool
    number: int
    goals: str
    participant: str
    last_step: str
    nodes: Mapping[str, MemberState]

    @property
    def is_starting(self) -> bool:
        """Whether it has no nodes yet, and would refuse requests."""
        return self.activity == "starting"

    @property
    def is_stopping(self) -> bool:
        """Whether it takes its nodes down because the process ends."""
        return self.activity in ("stopping", "stopped")

    def received(self, sender: str) -> int:
        """Return the number of the last step that was received if it is from ``sender``, else 0."""
        last_sender, _, number = self.last_step.partition(" ")
        return int(number) if last_sender == sender and number.isdecimal() else 0

    @property
    def identity(self) -> tuple[str, str, float]:
        """What no other process has."""
        return self.host, self.pid, self.started_s


def signed_report(stamp_ns: int, statuses: Iterable[Status], key: str) -> bytes:
    """Return a report as :func:`write_array` does, with its signature."""
    content = write_array(stamp_ns, statuses, "0" * _DIGITS)
    content += bytes(-len(content) % _ALIGNED)  # otherwise, the middleware does that
    signature = _signature(content, key).encode()
    return content[:_SIGNATURE_AT] + signature + content[_SIGNATURE_END:]


def is_signed(content: bytes, key: str) -> bool:
    """Return whether a process with this key, which is not empty, has sent a report."""
    signature = content[_SIGNATURE_AT:_SIGNATURE_END]
    return bool(key) and hmac.compare_digest(signature, _signature(content, key).encode())


def _signature(content: bytes, key: str) -> str:
    digest = hmac.new(key.encode(), content[_HEADER:_SIGNATURE_AT], _DIGEST)
    digest.update(memoryview(content)[_SIGNATURE_END:])
    return digest.hexdigest()


def parse_report(content: bytes) -> MemberReport | None:
    """Return the report in a serialized message, None if it is none."""
    try:
        _, [system, *nodes] = read_array(content)
        values = system.values
        started_s = finite(values.get("started", "0"))
        number = int(values.get("number", "0"))
    except ValueError:
        return None
    host = values.get("host", "")
    return MemberReport(
        activity=values.get("activity", ""),
        host=host,
        pid=values.get("pid", ""),
        started_s=started_s,
        is_child=values.get("is_child") == "true",
        number=number,
        goals=values.get("goals", ""),
        participant=values.get("participant", ""),
        last_step=values.get("last_step", ""),
        nodes={status.name.partition(": ")[2]: _node(status.values, host) for status in nodes},
    )


def _node(values: Mapping[str, str], host: str) -> MemberState:
    state, held_down = values.get("state", ""), values.get("held_down", "")
    return MemberState(state, held_down, _figures(values, host))


def _figures(values: Mapping[str, str], host: str) -> Mapping[str, Any]:
    """Return the figures in a report from a host; none if it is not of this version."""
    try:
        rates = {name: optional(values[name]) for name in _RATES}
        counts = {name: int(values[name]) for name in _COUNTS}
        by_name = {name: _counts(values[name]) for name in _COUNTS_BY_NAME}
    except (KeyError, ValueError):
        return {}
    place = {"host": host, "pid": values.get("pid", "")}
    return {**rates, **counts, **by_name, **place, "slowest": values.get("slowest", "")}


def _counts(text: str) -> Mapping[str, int]:
    pairs = (item.partition("=") for item in text.split())
    return {name: int(count) for name, _, count in pairs}


class NodeFigures:
    """The rates and counters of a node over all lives of its process, which count from zero."""

    def __init__(self) -> None:
        self._reported: Mapping[str, Any] = {}
        self._counts: Counter[str] = Counter()  # of the last report
        self._earlier: Counter[str] = Counter()  # counted by earlier lives
        self._known = False
        self._before: Counter[str] = Counter()  # counted before this process was there

    def take(self, figures: Mapping[str, Any], *, is_started_here: bool) -> None:
        """Receive what the process reports."""
        if not figures:
            return
        self._reported = figures
        self._counts = _counters(figures)
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
        """The figures by the names of the fields of ``NodeStatus``, of all lives so far."""
        totals = {name: self._counts[name] + self._earlier[name] for name in _COUNTS}
        return {**self._reported, **totals}

    @property
    def since_start(self) -> Mapping[str, int]:
        """The counters since this process knows the node."""
        return self._counts + self._earlier - self._before


def _counters(figures: Mapping[str, Any]) -> Counter[str]:
    counts = Counter({name: figures.get(name, 0) for name in _COUNTS})
    for name in _COUNTS_BY_NAME:
        counts[name] = sum(figures.get(name, {}).values())
    return counts
