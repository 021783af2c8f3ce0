"""The topics of the manager: ``/diagnostics``, and the reports ``state`` and ``callbacks``.

States are published on each change, and while there are subscriptions every second and for each new
one. Timings of callbacks are published every second while there are subscriptions.

The messages on ``/diagnostics`` (REP 107) have a status of the system, each node and each callback,
for tools of ROS. What commands and other processes need is in the reports of
:mod:`composer.runtime.protocol`.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import fields, replace
from functools import lru_cache
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.event_handler import QoSPublisherEventType, UnsupportedEventTypeError
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.time import Time
from std_msgs.msg import String

from composer.base.fast_dataclass import dataclass
from composer.runtime.callbacks.log import Write
from composer.runtime.executors.loop import Loop
from composer.runtime.members.lives import REPORTS_WITHIN_S
from composer.runtime.node.managed_node import ManagedNode
from composer.runtime.node.options import ProcessContext
from composer.runtime.protocol.codec import encode
from composer.runtime.protocol.reports import (
    CallbackFigures,
    ChainFigures,
    NodeReport,
    SystemReport,
    TimingReport,
    signed,
)
from composer.runtime.protocol.requests import CALLBACKS_TOPIC, STATE_TOPIC, Instance
from composer.runtime.ros.service_requests import CALLBACKS_QOS, STATE_QOS
from composer.runtime.supervision.main_queue import Command
from composer.runtime.supervision.status import Status

#: Most values are as in the message before, and making them again takes most of the time.
_KEPT_VALUES = 8192
#: The name of a node is the name of its status.
_NODE_FIELDS = tuple(
    field.name
    for field in fields(NodeReport)
    if field.name not in ("node", "since_s", "starts_active", "is_required", "is_optional")
)
_CALLBACK_FIELDS = [field.name for field in fields(CallbackFigures)]
_DIAGNOSTICS = "/diagnostics"
_NS_PER_S = 10**9
_LONGEST_PERIOD_S = 1.0
#: Changes within this time, as in a bring-up, become one message. With many nodes, a message costs
#: several milliseconds, so changes then wait longer: messages take at most 2 % of the time. While
#: more changes follow, they wait for half a second.
_BATCH_S = 0.05
_LONGEST_BATCH_S = 0.5
_MAX_SHARE = 0.02
#: The coordinating process gives up a process whose reports are missing, after this time at most.
_OUTDATED_S = REPORTS_WITHIN_S + 1.0


def diagnostic_array(
    report: SystemReport,
    uptime_s: float,
    chains: Iterable[ChainFigures],
    callbacks: Iterable[CallbackFigures],
) -> DiagnosticArray:
    """Return the message about a system, its nodes and its callbacks, with the report's time."""
    statuses = [
        _of_system(report, uptime_s, chains),
        *(_of_node(report.name, node) for node in report.nodes),
        *(_of_callback(report.name, callback) for callback in callbacks),
    ]
    message = DiagnosticArray(status=statuses)
    message.header.stamp = Time(nanoseconds=int(report.at_s * 1e9)).to_msg()
    return message


def _of_system(
    report: SystemReport, uptime_s: float, chains: Iterable[ChainFigures]
) -> DiagnosticStatus:
    level = DiagnosticStatus.OK
    if report.failed:
        level = DiagnosticStatus.ERROR
    elif not report.is_active:
        level = DiagnosticStatus.WARN
    values = {
        "activity": report.activity,
        "active": report.is_active,
        "ready": report.is_ready,
        "host": report.host,
        "pid": report.pid,
        "started": f"{report.started_s:.3f}",
        "uptime": f"{uptime_s:.3f}",
    }
    values |= {f"chain {chain.chain}": chain.text for chain in chains}
    return _status(level, report.name, report.name, report.message, values)


def _of_node(system: str, node: NodeReport) -> DiagnosticStatus:
    level = DiagnosticStatus.OK
    message = node.state
    if node.held_down:
        level = DiagnosticStatus.ERROR if node.is_required else DiagnosticStatus.WARN
        message = f"{node.state} ({node.condition or 'failed'}): {node.held_down}"
    elif node.condition:
        level = DiagnosticStatus.WARN
        message = f"{node.state} ({node.condition})"
    elif node.state != "active":
        level = DiagnosticStatus.WARN
    values = {name: getattr(node, name) for name in _NODE_FIELDS}
    values["since"] = f"{node.since_s:.3f}"
    return _status(level, system, f"{system}: {node.node}", message, values)


def _of_callback(system: str, figures: CallbackFigures) -> DiagnosticStatus:
    is_ok = not (figures.overruns or figures.dropped)
    values = {name: getattr(figures, name) for name in _CALLBACK_FIELDS}
    return _status(
        DiagnosticStatus.OK if is_ok else DiagnosticStatus.WARN,
        system,
        f"{system}: {figures.node} {figures.callback}",
        f"{figures.overruns} over budget, {figures.dropped} dropped",
        values,
    )


def _status(
    level: bytes, system: str, name: str, message: str, values: Mapping[str, Any]
) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=level,
        name=_valid(name),
        message=_valid(message),
        hardware_id=system,
        values=[
            _value(key, tuple(value.items()) if isinstance(value, dict) else value)
            for key, value in values.items()
        ],
    )


@lru_cache(_KEPT_VALUES, typed=True)
def _value(key: str, value: Any) -> KeyValue:
    return KeyValue(key=_valid(key), value=_valid(_text(value)))


def _valid(text: str) -> str:
    """Return a text that rclpy can send: errors of user code may have half surrogates."""
    return text if text.isascii() else text.encode(errors="replace").decode()


def _text(value: Any) -> str:
    """Return a value in words: ``true``, ``0.5``, ``/scan=3 /odom=4``, and nothing for None."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return " ".join(item if isinstance(item, str) else "{}={}".format(*item) for item in value)
    return "" if value is None else str(value)


class ReportTimes:
    """When the last reports of this process were published: no step is run too late.

    DDS repeats what was lost for longer than the coordinating process waits: after the network has
    failed for a while, steps arrive that it has given up. The clocks of two computers may differ,
    so a request is as old as the last report that its sender had seen.
    """

    def __init__(self) -> None:
        self._times: deque[tuple[int, float]] = deque()

    def note(self, number: int, now_s: float) -> None:
        """Note that a report is the current one now: it is published, or none has to follow yet."""
        if self._times and self._times[-1][0] == number:
            self._times.pop()
        self._times.append((number, now_s))
        while self._times[0][1] < now_s - _OUTDATED_S and len(self._times) > 1:
            self._times.popleft()

    def is_outdated(self, number: int, now_s: float) -> bool:
        """Return whether the sender of a request had last seen a report that is too old."""
        limit_s = now_s - _OUTDATED_S
        return not any(known == number and at_s >= limit_s for known, at_s in self._times)


@dataclass(frozen=True, slots=True)
class ManagerContext:
    """What a manager node has of its process: the status of the system, and what it calls.

    With ``report_key``, another process of the system moves all nodes by this manager, and reports
    are signed with the key. The functions are called on the loop of the manager.
    ``on_command(command)`` receives the commands; ``on_older_instance(instance)`` is called while
    the system starts if another process runs it already; ``update_status()`` updates rates and
    states; ``callbacks()`` and ``chains()`` return timings; ``nodes()`` returns the nodes by their
    full names; ``recreate(node)``, called on the loop of the node, replaces it by a new one if it
    is finalized, and returns why it cannot be created, or None; ``expect_end()`` is called before
    the last transitions that another process requests; ``save_recording(done)`` writes the last
    seconds, if the system has a flight recorder; ``write_log`` receives the lines of the manager's
    log.
    """

    status: Status
    report_key: str
    on_command: Callable[[Command], None]
    on_older_instance: Callable[[Instance], None]
    update_status: Callable[[], None]
    callbacks: Callable[[], tuple[CallbackFigures, ...]]
    chains: Callable[[], tuple[ChainFigures, ...]]
    nodes: Callable[[], Mapping[str, ManagedNode]]
    recreate: Callable[[ManagedNode], str | None]
    expect_end: Callable[[], None]
    save_recording: Callable[[Callable[[bool, str], None]], None]
    write_log: Write


class ReportPublisher:
    """Publishes reports of the system. Use it on ``loop``, except for :meth:`publish_soon`."""

    def __init__(
        self, process: ProcessContext, loop: Loop, context: ManagerContext, participant: str
    ) -> None:
        """Signed reports name the ``participant`` of the process."""
        self._node = process.manager
        self._loop = loop
        self._clock = loop.clock
        self._events = process.events
        self._context = context
        #: The process in reports; empty if they are not signed.
        self.participant = participant if context.report_key else ""
        self._started_s = self._clock.monotonic()
        self._times = ReportTimes()
        self._publish_due = threading.Lock()  # held while a message with changes is due
        self._batch_s = _BATCH_S
        self._changed_s = self._due_s = 0.0  # monotonic: the last change, when it is published
        self._published_s = 0.0  # monotonic
        #: The number of reports so far.
        self.number = 0
        #: Whether reports have timings: the last ones, for the coordinating process.
        self.includes_timings = False
        self._diagnostics = self._publisher(DiagnosticArray, _DIAGNOSTICS, 10, self.publish)
        # Not at once: ``ros2 topic echo`` would report the last one as lost, which it gets first.
        self._state = self._publisher(String, f"~/{STATE_TOPIC}", STATE_QOS, self.publish_soon)
        self._callbacks = self._publisher(
            String, f"~/{CALLBACKS_TOPIC}", CALLBACKS_QOS, self._publish_callbacks
        )

    @property
    def uptime_s(self) -> float:
        """How long the process has run; not by the time of day, which may differ between hosts."""
        return self._clock.monotonic() - self._started_s

    def report(self) -> SystemReport:
        """Return the current report. Thread-safe."""
        status = self._context.status.snapshot()
        timings = self.timings() if self.includes_timings else TimingReport()
        called = (item for item in timings.callbacks if item.count or item.dropped)
        return replace(
            status,
            at_s=self._now_s,
            number=self.number,
            participant=self.participant,
            callbacks=tuple(replace(item, histogram="") for item in called),
            chains=timings.chains,
        )

    def timings(self) -> TimingReport:
        """Return the current timings. Thread-safe."""
        return TimingReport(self._context.callbacks(), self._context.chains(), self._now_s)

    def tick(self) -> None:
        """Publish for subscriptions. Call it every second."""
        if self._state.get_subscription_count() or self._diagnostics.get_subscription_count():
            self.publish()
        else:
            self._times.note(self.number, self._clock.monotonic())
        if self._callbacks.get_subscription_count():
            self._publish_callbacks()

    def is_outdated(self, number: int) -> bool:
        """Return whether the sender of a request had last seen a report that is too old."""
        return self._times.is_outdated(number, self._clock.monotonic())

    def publish_soon(self) -> None:
        """Publish a change, with others that follow. Thread-safe."""
        self._changed_s = self._clock.monotonic()
        if self._publish_due.acquire(blocking=False):
            self._due_s = self._changed_s + max(self._batch_s, _LONGEST_BATCH_S)
            self._loop.call_later(self._batch_s, self._publish_changes)

    def publish(self) -> None:
        """Publish the status."""
        start_s = self._clock.monotonic()
        self.number += 1
        report = self.report()
        self._state.publish(String(data=signed(encode(report), self._context.report_key)))
        self._times.note(self.number, self._clock.monotonic())
        if self._diagnostics.get_subscription_count():
            chains, callbacks = self._context.chains(), self._context.callbacks()
            self._diagnostics.publish(diagnostic_array(report, self.uptime_s, chains, callbacks))
        self._published_s = self._clock.monotonic()
        took_s = self._published_s - start_s
        self._batch_s = min(max(_BATCH_S, took_s / _MAX_SHARE), _LONGEST_PERIOD_S)

    @property
    def _now_s(self) -> float:
        return float(self._node.get_clock().now().nanoseconds / _NS_PER_S)

    def _publisher(
        self, kind: type[Any], name: str, profile: QoSProfile | int, publish: Callable[[], None]
    ) -> Publisher:
        """Create a publisher; call ``publish`` for each new subscription."""
        publisher = self._node.create_publisher(kind, name, profile)
        subscriptions = 0

        def on_matched() -> None:
            nonlocal subscriptions
            before, subscriptions = subscriptions, publisher.get_subscription_count()
            if subscriptions > before:
                publish()

        with suppress(UnsupportedEventTypeError):  # then the next message follows within a second
            event = QoSPublisherEventType.RCL_PUBLISHER_MATCHED
            self._events.watch(publisher.handle, event, on_matched)
        return publisher

    def _publish_callbacks(self) -> None:
        self._callbacks.publish(String(data=encode(self.timings())))

    def _publish_changes(self) -> None:
        left_s = min(self._changed_s + self._batch_s, self._due_s) - self._clock.monotonic()
        if left_s > 0.0:
            self._loop.call_later(left_s, self._publish_changes)
            return
        self._publish_due.release()
        self.publish()
