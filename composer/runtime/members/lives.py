"""The lives of a process of the system, one after the other, and what is counted over all of them.

Which messages on the topic ``state`` are reports of the process: any node can publish there, and a
replayed bag does. So a report counts only if it is signed with the key of the process: the one that
it was started with, that in its instance lock or, on another computer, the one that its service
answers. What the process is, is learnt from its instance lock, its end as a child, or that answer.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import field
from typing import TYPE_CHECKING, Any

from rclpy.node import Node as RosNode
from std_msgs.msg import String

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, Process
from composer.model.hosts import own_enclave
from composer.model.names import PROGRAM_LOGGER
from composer.runtime.children.child_processes import Child, ChildProcesses, Command
from composer.runtime.executors.loop import Loop
from composer.runtime.middleware.environment import CONSOLE_FORMAT
from composer.runtime.node.managed_node import RunState
from composer.runtime.process.instance_lock import (
    ALREADY_RUNS,
    REPORT_KEY_VARIABLE,
    is_held,
    report_key,
)
from composer.runtime.protocol.codec import ProtocolError, decode
from composer.runtime.protocol.reports import NodeReport, SystemReport, is_signed, split_signature
from composer.runtime.protocol.requests import NAME, STATE_TOPIC
from composer.runtime.ros.service_requests import STATE_QOS

if TYPE_CHECKING:
    from composer.runtime.members.node import MemberNode

#: Processes report every second. One that has not reported for this time is lost.
REPORTS_WITHIN_S = 5.0
_CHECK_PERIOD_S = 0.5
_COUNTS = ("errors", "overruns", "queue_drops", "calls", "skipped")
_COUNTS_BY_NAME = ("sent", "received", "dropped", "qos_events")
_FIGURES = ("sent_hz", "received_hz", "busy", "slowest", "host", "pid", *_COUNTS, *_COUNTS_BY_NAME)


class ProcessUnavailable(Exception):
    """The process cannot be started, or has ended; the text is the reason."""


@dataclass(frozen=True, slots=True)
class MemberContext:
    """What a process of the system needs from the one that coordinates it.

    ``namespace`` is where the coordinating manager is; ``command`` starts ``compose run`` with the
    same system, and is empty if the process is only to be awaited. What nodes report within the
    context manager ``together`` is handled together.
    """

    loop: Loop
    manager: RosNode
    children: ChildProcesses
    namespace: str
    command: Sequence[str]
    write_log: Callable[[LogLevel, str, str], None]
    run_state: RunState
    together: Callable[[], AbstractContextManager[None]] = nullcontext

    def full_name(self, process: Process) -> str:
        """Return the full name of a process, which is the namespace of its manager."""
        return f"{self.namespace}/{process.name.value}"

    def command_of(self, process: Process, report_key: str) -> Command:
        """Return the command that starts a process, which signs its reports with the key."""
        words = (*self.command, "--process", process.name.value)
        # Its lines are parsed, whatever format the lines of this process have.
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


class NodeFigures:
    """The rates and counters of a node over all lives of its process, which count from zero."""

    def __init__(self) -> None:
        self._reported: dict[str, Any] = {}
        self._counts: Counter[str] = Counter()  # of the last report
        self._earlier: Counter[str] = Counter()  # counted by earlier lives
        #: Counted before this process was there; None before the first report.
        self._before: Counter[str] | None = None

    def take(self, node: NodeReport, host: str, *, is_started_here: bool) -> None:
        """Receive what the process, on a host, reports of the node."""
        self._reported = {name: getattr(node, name) for name in _FIGURES}
        self._reported["host"] = node.host or host
        self._counts = Counter({name: getattr(node, name) for name in _COUNTS})
        for name in _COUNTS_BY_NAME:
            self._counts[name] = sum(getattr(node, name).values())
        if self._before is None:
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
        return self._counts + self._earlier - (self._before or Counter())


class MemberLives:
    """The life that the process has now, and what ends it. Use it on the loop of ``context``."""

    def __init__(
        self,
        name: str,
        label: str,
        context: MemberContext,
        members: Mapping[str, MemberNode],
        on_failure: Callable[[str, bool], None],
    ) -> None:
        """``name`` is the namespace of the manager of the process, ``label`` the name in messages.

        ``members`` are the nodes of the process, by their full names.
        ``on_failure(reason, is_expected)`` is called when a life ends or is lost.
        """
        self._name = name
        self._label = label
        self._context = context
        self._members = members
        self._on_failure = on_failure
        self.current: MemberLife | None = None  # from the start, or the first report, to the end
        #: The last report of all lives.
        self.last_report: SystemReport | None = None
        self.may_start = bool(context.command)
        self.is_ending = False
        self._clock = context.loop.clock
        self._checked_s = self._clock.monotonic()
        self._timer = context.loop.call_every(_CHECK_PERIOD_S, self._check)

    @property
    def up(self) -> MemberLife | None:
        """The current life, if it reports."""
        return self.current if self.current is not None and self.current.is_up else None

    def end(self, life: MemberLife, child: Child) -> None:
        """Handle the end of a child."""
        if self.current is not life:
            return
        self.current = None
        if life.last is not None and child.ended.result() == ALREADY_RUNS:
            self.may_start = False  # it has found another one, on another computer
        self._end_counts()
        self._on_failure(f"{self._label} {child.how_ended}", self.is_ending)

    def lose(self, life: MemberLife, reason: str) -> None:
        """Report the failure of all nodes of a process, which may return."""
        if not life.lost:
            life.lost = reason
            self._on_failure(f"{self._label} {reason}", False)

    def of_report(self, report: SystemReport, key: str) -> MemberLife | None:
        """Return the life that a report belongs to; None if the report does not count."""
        life = self.current
        if life is None or key != life.report_key:
            return self._next(report, key)
        is_new = life.last is None or report.number > life.last.number
        return life if is_new else None

    def take(self, report: SystemReport, life: MemberLife) -> None:
        """Keep a report of a life as its last one."""
        life.last, life.reported_s = report, self._clock.monotonic()
        self.last_report = report
        for node in report.nodes:
            member = self._members.get(node.node)
            if member is not None:
                is_child = life.child is not None
                member.all_figures.take(node, report.host, is_started_here=is_child)

    def warn(self, text: str) -> None:
        """Log a warning about the process."""
        self._context.write_log(LogLevel.WARN, PROGRAM_LOGGER, f"{self._label} {text}")

    def close(self) -> None:
        """Stop to check whether the process reports."""
        self._timer.cancel()

    def _next(self, report: SystemReport, key: str) -> MemberLife | None:
        """Return the life of a process that was started elsewhere; None if it is not to be used."""
        life = self.current
        if report.is_child or report.is_stopping or (life is None and self.is_ending):
            return None  # another child ends with its coordinator
        if life is not None and life.last is not None:
            if not life.lost and report.started_s < life.last.started_s:
                return None  # it has been replaced, or is about to be refused
            self.lose(life, "has ended")
        return self._use(report, key)

    def _use(self, report: SystemReport, key: str) -> MemberLife:
        """Use a process that was started elsewhere, and start none from now on."""
        self._end_counts()
        self.current = life = MemberLife(key, holds_lock=is_held(self._name))
        self.may_start = False
        text = (
            f"{self._label} was not started here; it is used: host {report.host},"
            f" process {report.pid}"
        )
        self._context.write_log(LogLevel.INFO, PROGRAM_LOGGER, text)
        return life

    def _end_counts(self) -> None:
        for member in self._members.values():
            member.all_figures.end_life()

    def _check(self) -> None:
        """Notice a process that does not report: it hangs, or is cut off."""
        now_s = self._clock.monotonic()
        late_s = now_s - self._checked_s - _CHECK_PERIOD_S  # this process did not run, not that one
        self._checked_s = now_s
        life = self.up
        if life is None or self.is_ending:
            return
        life.reported_s += max(0.0, late_s)
        if life.holds_lock and not is_held(self._name):
            self.lose(life, "has ended")
        elif now_s - life.reported_s >= REPORTS_WITHIN_S:
            self.lose(life, f"has not reported for {REPORTS_WITHIN_S:g} s")


class MemberReports:
    """The subscription to the reports of a process. Use it on the loop of ``context``."""

    def __init__(
        self,
        name: str,
        context: MemberContext,
        lives: MemberLives,
        ask_for_key: Callable[[], None],
        on_report: Callable[[SystemReport, MemberLife], None],
    ) -> None:
        """``name`` is the namespace of the manager of the process.

        ``ask_for_key()`` asks the service of a process on another computer for its key. The reports
        that count go to ``on_report``.
        """
        self._name = name
        self._context = context
        self._lives = lives
        self._ask_for_key = ask_for_key
        self._on_report = on_report
        self._answered_key = ""  # of a process whose service was asked for it
        self._unsigned = ""  # the report for which it was asked
        self._problem = ""
        self._subscription = context.manager.create_subscription(
            String, f"{name}/{NAME}/{STATE_TOPIC}", lambda _: None, STATE_QOS
        )
        context.loop.add_subscription(
            self._subscription, lambda taken: self._on_message(taken[0].data)
        )

    @property
    def missing(self) -> str:
        """Why there is no report, as far as it is known."""
        if self._problem:
            return self._problem
        is_there = self._context.manager.count_publishers(self._subscription.topic_name)
        return "its reports do not arrive" if is_there else "it is not in the ROS graph"

    def on_key(self, key: str) -> None:
        """Use the key that the service has answered for the report for which it was asked."""
        self._answered_key = key
        self._on_message(self._unsigned)

    def close(self) -> None:
        """Destroy the subscription."""
        self._context.loop.remove(self._subscription)
        self._context.manager.destroy_subscription(self._subscription)

    def _on_message(self, text: str) -> None:
        key = self._key_of(text)
        if not key:
            return
        try:
            report = decode(split_signature(text)[1], SystemReport)
        except ProtocolError as error:
            if str(error) != self._problem:
                self._problem = str(error)
                self._lives.warn(f"reports what cannot be read: {error}")
            return
        life = self._lives.of_report(report, key)
        if life is not None and not report.is_starting:
            self._on_report(report, life)

    def _key_of(self, text: str) -> str:
        """Return the key that has signed a message; empty if the process has not signed it."""
        life = self._lives.current
        if life is not None and is_signed(text, life.report_key):
            return life.report_key
        if life is not None and life.child is not None:
            return ""
        key_here = report_key(self._name)
        key = self._answered_key if key_here is None else key_here
        if is_signed(text, key):
            return key
        if key_here is None:
            self._unsigned = text
            self._ask_for_key()
        return ""
