"""The system's own node: what can be asked of the system as a whole, and how it is.

Its services are those of nav2's lifecycle manager as far as both have them (std_srvs/srv/Trigger):
``startup``, ``pause``, ``resume``, ``reset``, ``shutdown`` and ``is_active``. It tells the state of
every node on ``/diagnostics`` (REP 107) and, latched, on ``state``: on change, and while somebody
listens each second and as soon as somebody does. What the callbacks of the nodes take it tells on
``callbacks`` and ``/diagnostics``, while somebody listens.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.event_handler import QoSPublisherEventType, UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.time_source import USE_SIM_TIME_NAME
from std_srvs.srv import Trigger

from composer.names import join
from composer.runtime.clock.clock import Clock
from composer.runtime.clock.sim_time import SimulatedTime
from composer.runtime.executors.event_counts import AnnouncedEvents
from composer.runtime.executors.event_loop import EventLoop
from composer.runtime.executors.factory import log_exception
from composer.runtime.executors.loop import Reply, Taken, never_called
from composer.runtime.manager.proxy_services import ProxyServices
from composer.runtime.metrics.diagnostics import Figures, to_message
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures
from composer.runtime.node.node import RunningNode, Shared
from composer.runtime.ros.manager_protocol import (
    CALLBACKS_QOS,
    CALLBACKS_TOPIC,
    IS_ACTIVE,
    NAME,
    STATE_QOS,
    STATE_TOPIC,
)
from composer.runtime.supervision.status import NodeStatus, Status, SystemStatus

COMMANDS = ("startup", "pause", "resume", "reset", "shutdown")
_DIAGNOSTICS = "/diagnostics"
_PERIOD_S = 1.0
_OWN = 1  # the subscription that looks for rivals
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
class ManagerCallbacks:
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
    """The node, and the loop of its own that serves it whatever the others do.

    Its subscription of /clock serves all nodes, so that none of them can hold up time.
    """

    def __init__(
        self,
        namespace: str,
        status: Status,
        office: ManagerCallbacks,
        *,
        use_sim_time: bool = False,
    ) -> None:
        """Join the ROS graph. With ``use_sim_time`` its stamps are the time of /clock."""
        self._status = status
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
        simulated_time = SimulatedTime(self._node, self._loop)
        self.shared = Shared(simulated_time, AnnouncedEvents(self._loop))
        self._clock = Clock(self._node, self._loop, simulated_time)
        self._node.set_parameters([Parameter(USE_SIM_TIME_NAME, value=use_sim_time)])
        self._diagnostics = self._publisher(_DIAGNOSTICS, 10, self._publish)
        self._state = self._publisher(f"~/{STATE_TOPIC}", STATE_QOS, self._publish)
        self._callbacks = self._publisher(
            f"~/{CALLBACKS_TOPIC}", CALLBACKS_QOS, self._publish_callbacks
        )
        for what in COMMANDS:
            self._serve(what, partial(self._take, what))
        self._serve(IS_ACTIVE, self._tell_whether_active)
        rivals = self._node.create_subscription(
            DiagnosticArray, f"~/{STATE_TOPIC}", self._look_at_rival, STATE_QOS
        )
        self._loop.add_subscription(rivals, self._look_at_rival)
        if any(node.left_to_manager for node in status.snapshot().nodes):
            ProxyServices(self._node, self._loop, office.members, self._publish)
        self._loop.start()
        self._loop.call_every(_PERIOD_S, self._tick)
        self._loop.call_soon(self._publish)
        status.on_change(self._publish_soon)

    def retire(self, *, linger: bool) -> None:
        """Tell the last state and fall silent; with ``linger`` an answer given just now arrives.

        With shared memory it would be gone with the node.
        """
        self._status.on_change(lambda: None)
        self._loop.call_soon(self._publish)
        if linger:
            time.sleep(_ANSWERS_ARRIVE_WITHIN_S)
        self._loop.stop(_ENDS_WITHIN_S)

    def destroy(self) -> None:
        """Leave the ROS graph."""
        self._node.destroy_node()

    def _publisher(
        self, name: str, profile: QoSProfile | int, tell: Callable[[], None]
    ) -> Publisher:
        """Make a publisher; whoever begins to listen to it is told at once."""
        publisher = self._node.create_publisher(DiagnosticArray, name, profile)
        listeners = 0

        def matched() -> None:
            nonlocal listeners
            before, listeners = listeners, publisher.get_subscription_count()
            if listeners > before:
                tell()

        with suppress(UnsupportedEventTypeError):  # then who listens is told within a second
            kind = QoSPublisherEventType.RCL_PUBLISHER_MATCHED
            self.shared.events.watch(publisher.handle, kind, matched)
        return publisher

    def _serve(self, name: str, callback: Callable[[Any, Reply], None]) -> None:
        service = self._node.create_service(Trigger, f"~/{name}", never_called)
        self._loop.add_service(service, callback)

    def _take(self, what: str, _: Trigger.Request, reply: Reply) -> None:
        def answer(success: bool, message: str) -> None:
            self._loop.call_soon(lambda: reply(Trigger.Response(success=success, message=message)))

        self._office.obey(Command(what, answer))

    def _tell_whether_active(self, _: Trigger.Request, reply: Reply) -> None:
        status = self._status.snapshot()
        reply(Trigger.Response(success=status.is_active, message=status.summary))

    def _tick(self) -> None:
        self._office.measure()
        heard = self._diagnostics.get_subscription_count()
        if heard or self._state.get_subscription_count() > _OWN:
            self._publish()
        if self._callbacks.get_subscription_count():
            self._publish_callbacks()

    def _publish_callbacks(self) -> None:
        figures: tuple[Figures, ...] = (*self._office.chains(), *self._office.callbacks())
        message = to_message(self._status.without_nodes.system, figures)
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._callbacks.publish(message)

    def _publish_soon(self) -> None:
        if self._due.acquire(blocking=False):
            self._loop.call_later(_TOGETHER_S, self._publish_changes)

    def _publish_changes(self) -> None:
        self._due.release()
        self._publish()

    def _look_at_rival(self, taken: Taken) -> None:
        """See whether another composer runs the same system, and for how long."""
        message: DiagnosticArray = taken[0]
        values = {item.key: item.value for item in message.status[0].values}
        rival = (values["host"], values["pid"])
        status = self._status.without_nodes
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
        message = diagnostics(self._status.snapshot(), self._uptime_s, self._office.chains())
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._state.publish(message)
        if self._diagnostics.get_subscription_count():
            callbacks = to_message(self._status.without_nodes.system, self._office.callbacks())
            message.status = [*message.status, *callbacks.status]
            self._diagnostics.publish(message)


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
        "qos_events": " ".join(f"{name}={count}" for name, count in node.qos_events.items()),
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
