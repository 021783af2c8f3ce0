"""The system's own node: what can be asked of the system as a whole, and how it is.

Its services are those of nav2's lifecycle manager as far as both have them (std_srvs/srv/Trigger):
``startup``, ``pause``, ``resume``, ``reset``, ``shutdown`` and ``is_active``. It tells the state of
every node on ``/diagnostics`` (REP 107) and, latched, on ``state``: each second and on change. What
the callbacks of the nodes take it tells on ``callbacks``, each second while somebody listens.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from composer.names import join
from composer.runtime.board import Board, NodeStatus, SystemStatus
from composer.runtime.callback_messages import Figures, to_message
from composer.runtime.deputy import Deputy
from composer.runtime.event_loop import EventLoop
from composer.runtime.executors import log_exception
from composer.runtime.figures import CallbackFigures, ChainFigures
from composer.runtime.loop import Reply, never_called
from composer.runtime.manager_topics import (
    CALLBACKS_QOS,
    CALLBACKS_TOPIC,
    NAME,
    STATE_QOS,
    STATE_TOPIC,
)
from composer.runtime.node import RunningNode

COMMANDS = ("startup", "pause", "resume", "reset", "shutdown")
IS_ACTIVE = "is_active"
_DIAGNOSTICS = "/diagnostics"
_PERIOD_S = 1.0
#: How often it is seen whether somebody listens, who is then told at once.
_LOOK_S = 0.25
#: Many changes at once, as in a bring-up, become one message.
_TOGETHER_S = 0.05
_ENDS_WITHIN_S = 0.2
_ANSWERS_ARRIVE_WITHIN_S = 0.15
#: Composers that started within so short a time of each other are told apart by their names.
_SAME_TIME_S = 0.1


@dataclass(frozen=True, slots=True)
class Command:
    """Somebody wants something of the system. ``answer(success, message)`` is called once."""

    what: str  # one of COMMANDS
    answer: Callable[[bool, str], None]


def manager_namespace(namespace: str, system: str) -> str:
    """Return the namespace of the manager node of a system in ``namespace``."""
    return join(namespace, system)


@dataclass(frozen=True, slots=True)
class Office:
    """Who is behind a manager; all of it is called on the manager's loop.

    ``obey`` takes commands; ``measure`` works out rates; ``callbacks`` returns what these took,
    ``chains`` how long data was on its way;
    ``yield_to(host, pid)`` is called when a composer that runs the same system was there first;
    ``members`` returns the nodes, by their full names.
    """

    obey: Callable[[Command], None]
    measure: Callable[[], None]
    callbacks: Callable[[], tuple[CallbackFigures, ...]]
    chains: Callable[[], tuple[ChainFigures, ...]]
    yield_to: Callable[[str, str], None]
    members: Callable[[], Mapping[str, RunningNode]]


class Manager:
    """The node, and the loop of its own that serves it whatever the others do."""

    def __init__(self, namespace: str, board: Board, office: Office) -> None:
        self._board = board
        self._office = office
        self._started_s = time.monotonic()
        self._rivals: set[tuple[str, str]] = set()
        self._loop = EventLoop(NAME, log_exception)
        self._due = threading.Lock()  # held while a message that tells the changes is due
        self._node = Node(
            NAME,
            namespace=namespace,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[Parameter("start_type_description_service", value=False)],
        )
        self._diagnostics = self._node.create_publisher(DiagnosticArray, _DIAGNOSTICS, 10)
        self._state = self._node.create_publisher(DiagnosticArray, f"~/{STATE_TOPIC}", STATE_QOS)
        self._callbacks = self._node.create_publisher(
            DiagnosticArray, f"~/{CALLBACKS_TOPIC}", CALLBACKS_QOS
        )
        self._listeners = 0
        for what in COMMANDS:
            self._serve(what, partial(self._take, what))
        self._serve(IS_ACTIVE, self._tell_whether_active)
        rivals = self._node.create_subscription(
            DiagnosticArray, f"~/{STATE_TOPIC}", self._look_at_rival, STATE_QOS
        )
        self._loop.add_subscription(rivals, self._look_at_rival)
        if any(node.left_to_manager for node in board.snapshot().nodes):
            Deputy(self._node, self._loop, office.members, self._publish)
        self._loop.start()
        self._loop.call_every(_PERIOD_S, self._tick)
        self._loop.call_every(_LOOK_S, self._look_for_listeners)
        self._loop.call_soon(self._publish)
        board.on_change(self._publish_soon)

    def retire(self, *, linger: bool) -> None:
        """Tell the last state and fall silent; with ``linger`` an answer given just now arrives.

        With shared memory it would be gone with the node.
        """
        self._board.on_change(lambda: None)
        self._loop.call_soon(self._publish)
        if linger:
            time.sleep(_ANSWERS_ARRIVE_WITHIN_S)
        self._loop.stop(_ENDS_WITHIN_S)

    def destroy(self) -> None:
        """Leave the ROS graph."""
        self._node.destroy_node()

    def _serve(self, name: str, callback: Callable[[Any, Reply], None]) -> None:
        service = self._node.create_service(Trigger, f"~/{name}", never_called)
        self._loop.add_service(service, callback)

    def _take(self, what: str, _: Trigger.Request, reply: Reply) -> None:
        def answer(success: bool, message: str) -> None:
            self._loop.call_soon(lambda: reply(Trigger.Response(success=success, message=message)))

        self._office.obey(Command(what, answer))

    def _tell_whether_active(self, _: Trigger.Request, reply: Reply) -> None:
        status = self._board.snapshot()
        reply(Trigger.Response(success=status.is_active, message=status.summary))

    def _tick(self) -> None:
        self._office.measure()
        self._publish()
        if self._listeners:
            self._publish_callbacks()

    def _look_for_listeners(self) -> None:
        before, self._listeners = self._listeners, self._callbacks.get_subscription_count()
        if self._listeners > before:
            self._publish_callbacks()

    def _publish_callbacks(self) -> None:
        figures: tuple[Figures, ...] = (*self._office.chains(), *self._office.callbacks())
        message = to_message(self._board.snapshot().system, figures)
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._callbacks.publish(message)

    def _publish_soon(self) -> None:
        if self._due.acquire(blocking=False):
            self._loop.call_later(_TOGETHER_S, self._publish_changes)

    def _publish_changes(self) -> None:
        self._due.release()
        self._publish()

    def _look_at_rival(self, message: DiagnosticArray) -> None:
        """See whether another composer runs the same system, and for how long."""
        values = {item.key: item.value for item in message.status[0].values}
        rival = (values["host"], values["pid"])
        status = self._board.snapshot()
        own = (status.host, str(status.pid))
        if rival == own:
            return
        if rival not in self._rivals:
            self._rivals.add(rival)  # the first message was latched, who knows when
            return
        lead_s = float(values["uptime"]) - self._uptime_s
        if lead_s > _SAME_TIME_S or (abs(lead_s) <= _SAME_TIME_S and rival < own):
            self._office.yield_to(*rival)

    @property
    def _uptime_s(self) -> float:
        # Not the time of day, on which two hosts may disagree.
        return time.monotonic() - self._started_s

    def _publish(self) -> None:
        message = diagnostics(self._board.snapshot(), self._uptime_s, self._office.chains())
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._diagnostics.publish(message)
        self._state.publish(message)


def diagnostics(
    status: SystemStatus, uptime_s: float, chains: Iterable[ChainFigures]
) -> DiagnosticArray:
    """Return the state of a system and of its nodes; the system comes first."""
    nodes = (_of_node(status.system, node) for node in status.nodes)
    return DiagnosticArray(status=[_of_system(status, uptime_s, chains), *nodes])


def _of_system(
    status: SystemStatus, uptime_s: float, chains: Iterable[ChainFigures]
) -> DiagnosticStatus:
    level = DiagnosticStatus.OK
    if status.failed:
        level = DiagnosticStatus.ERROR
    elif not status.is_active:
        level = DiagnosticStatus.WARN
    values = {
        "activity": status.activity,
        "active": str(status.is_active).lower(),
        "host": status.host,
        "pid": str(status.pid),
        "started": f"{status.started_s:.3f}",
        "uptime": f"{uptime_s:.3f}",
    }
    values |= {f"chain {chain.chain}": chain.text for chain in chains}
    return _status(status.system, status.system, level, status.summary, values)


def _of_node(system: str, node: NodeStatus) -> DiagnosticStatus:
    level = DiagnosticStatus.OK
    message = node.state
    if node.held_down:
        level = DiagnosticStatus.ERROR
        message = f"{node.state}: {node.held_down}"
    elif node.state != "active":
        level = DiagnosticStatus.WARN
    values = {
        "state": node.state,
        "wanted": node.wanted,
        "left_to_manager": " ".join(node.left_to_manager),
        "since": f"{node.since_s:.3f}",
        "restarts": str(node.restarts),
        "errors": str(node.errors),
        "last_error": node.last_error,
        "held_down": node.held_down,
        "sent_hz": f"{node.sent_hz:.1f}",
        "received_hz": f"{node.received_hz:.1f}",
        "busy": f"{node.busy:.4f}",
        "slowest": node.slowest,
        "overruns": str(node.overruns),
        "queue_drops": str(node.queue_drops),
    }
    return _status(f"{system}: {node.node}", system, level, message, values)


def _status(
    name: str, system: str, level: bytes, message: str, values: dict[str, str]
) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=level,
        name=name,
        message=message,
        hardware_id=system,
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
