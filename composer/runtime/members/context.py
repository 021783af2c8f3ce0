"""What a process of the system needs from the one that coordinates it, and one of its lives."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import field
from typing import Any, Protocol

from rclpy.node import Node as RosNode

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, Process
from composer.model.hosts import own_enclave
from composer.runtime.children.child_processes import Child, ChildProcesses, Command
from composer.runtime.executors.loop import Loop
from composer.runtime.members.kept_goals import KeptGoals
from composer.runtime.middleware.environment import CONSOLE_FORMAT
from composer.runtime.process.instance_lock import REPORT_KEY_VARIABLE
from composer.runtime.protocol.reports import NodeReport, SystemReport


class ProcessUnavailable(Exception):
    """The process cannot be started, or has ended; the text is the reason."""


class Member(Protocol):
    """A node of the process. Called on the loop."""

    @property
    def full_name(self) -> str:
        """Its name in reports."""

    @property
    def state(self) -> str:
        """Its lifecycle state, as far as this process knows."""

    def on_report(self, reported: NodeReport) -> None:
        """Receive its state, with each report."""

    def on_process_end(self, reason: str) -> None:
        """Receive that the process has ended or does not report any more."""

    def on_process_return(self) -> None:
        """Receive that the process is there again, without a start from here."""


@dataclass(frozen=True, slots=True)
class MemberContext:
    """What a process of the system needs from the one that coordinates it.

    ``namespace`` is that of the coordinating manager; ``command`` starts ``compose run`` with the
    same system, and is empty if the process is only to be awaited. ``goals`` are those of the whole
    system, which its processes keep. What nodes report within the context manager ``together`` is
    handled together.
    """

    loop: Loop
    manager: RosNode
    children: ChildProcesses
    namespace: str
    command: Sequence[str]
    goals: KeptGoals
    write_log: Callable[[LogLevel, str, str], None]
    together: Callable[[], AbstractContextManager[None]] = nullcontext

    def full_name(self, process: Process) -> str:
        """Return the full name of a process, which is the namespace of its manager."""
        return f"{self.namespace}/{process.name.value}"

    def command_of(self, process: Process, report_key: str) -> Command:
        """Return the command that starts a process, which signs its reports with the key."""
        words = (*self.command, "--process", process.name.value)
        # Its lines are parsed, whatever format those of this process have.
        usual = {"PYTHONUNBUFFERED": "1", "RCUTILS_CONSOLE_OUTPUT_FORMAT": CONSOLE_FORMAT}
        usual |= own_enclave(os.environ, self.full_name(process))
        environment = {name.value: value for name, value in process.environment}
        return Command(words, {**usual, **environment, REPORT_KEY_VARIABLE: report_key})


@dataclass(slots=True)
class MemberLife:
    """One life of the process, as a child or started elsewhere, and its last report.

    Its reports are signed with ``report_key``. ``lost`` is why its nodes have failed, although
    it may still run. ``holds_lock`` is whether it holds the instance lock on this computer.
    ``answered`` are the numbers of the last reports before the responses to requests, by node.
    """

    report_key: str
    child: Child | None = None
    last: SystemReport | None = None
    reported_s: float = 0.0
    lost: str = ""
    holds_lock: bool = False
    answered: dict[str, int] = field(default_factory=dict)

    @property
    def states(self) -> Mapping[str, NodeReport]:
        """The nodes in the last report."""
        return {} if self.last is None else {node.node: node for node in self.last.nodes}

    @property
    def is_up(self) -> bool:
        """Whether it reports."""
        return self.last is not None and not self.lost


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
