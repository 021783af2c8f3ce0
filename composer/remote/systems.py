"""Running systems: reports and commands through their manager nodes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from std_srvs.srv import Trigger

from composer.remote.name_matching import NotFoundError, not_found_error
from composer.remote.requests import call_once
from composer.remote.session import Deadline, NoResponseError, Session
from composer.runtime.metrics.diagnostics import from_message
from composer.runtime.metrics.figures import CallbackFigures, ChainFigures
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.ros.manager_protocol import (
    CALLBACKS_QOS,
    CALLBACKS_TOPIC,
    IS_ACTIVE,
    NAME,
    STATE_QOS,
    STATE_TOPIC,
)

_TRIGGER_TYPE = "std_srvs/srv/Trigger"
_SERVICE = f"/{NAME}/{IS_ACTIVE}"
#: Fast DDS discovers a participant at once or within 3 s; managers report every second.
DISCOVERY_S = 3.5
#: How long to wait for the last messages of a process that has ended.
_LAST_MESSAGES_S = 0.1


@dataclass(frozen=True, slots=True)
class NodeReport:
    """A node as its manager reports it. ``since_s`` is in seconds since 1970."""

    node: str
    state: str
    desired: str
    since_s: float
    restarts: int
    errors: int
    last_error: str
    held_down: str
    sent_hz: float
    received_hz: float
    busy: float
    slowest: str
    overruns: int
    queue_drops: int
    qos_events: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class SystemReport:
    """A system as its manager reports it. ``name`` is the namespace of the manager.

    ``callbacks`` and ``chains`` are included on request, with their time ``callbacks_at_s``.
    """

    name: str
    activity: str
    message: str
    host: str
    pid: str
    nodes: tuple[NodeReport, ...]
    callbacks: tuple[CallbackFigures, ...] = ()
    chains: tuple[ChainFigures, ...] = ()
    callbacks_at_s: float = 0.0


class Systems:
    """Queries and commands managers, all within one time limit.

    With ``callbacks``, reports include callbacks and chains.
    """

    def __init__(self, session: Session, deadline: Deadline, *, callbacks: bool = False) -> None:
        self._session = session
        self._deadline = deadline
        self._with_callbacks = callbacks
        self._states: dict[str, DiagnosticArray] = {}
        self._callbacks: dict[str, DiagnosticArray] = {}
        self._subscriptions: dict[str, list[Subscription]] = {}

    def discover(self) -> tuple[str, ...]:
        """Return the names of all systems discovered so far, and subscribe to their reports.

        The name is the namespace of the manager: ``/pipeline``, ``/robot1/pipeline``.
        """
        found = tuple(
            sorted(
                name.removesuffix(_SERVICE)
                for name, types in self._session.node.get_service_names_and_types()
                if name.endswith(_SERVICE) and _TRIGGER_TYPE in types
            )
        )
        self.subscribe(found)
        return found

    def subscribe(self, names: Iterable[str]) -> None:
        """Subscribe to the reports of systems, which need not be discovered yet."""
        for name in names:
            if name not in self._subscriptions:
                self._subscriptions[name] = self._subscribe(name)

    def find(self, name: str) -> str:
        """Return the full name of a running system. Raises NotFoundError."""
        found = _matches(name, local_systems())
        if not found:
            known = self._session.wait_until_settled(self.discover, self._deadline)
            found = _matches(name, known)
        if not found:
            error = not_found_error("running system", name, (*local_systems(), *known))
            none = "no system is running: start one with 'compose run'"
            raise NotFoundError(str(error), error.hint if known else none)
        if len(found) > 1:
            raise NotFoundError(
                f"'{name}' matches more than one system", f"use a full name: {', '.join(found)}"
            )
        return found[0]

    def only(self) -> str:
        """Return the full name of the only running system. Raises NotFoundError."""
        known = sorted(local_systems()) or self._session.wait_until_settled(
            self.discover, self._deadline
        )
        if not known:
            raise NotFoundError("no system is running", "start one with 'compose run'")
        if len(known) > 1:
            raise NotFoundError(
                "more than one system is running", f"specify one of: {', '.join(known)}"
            )
        return known[0]

    def report(self, name: str) -> SystemReport:
        """Return the report of a system. Raises NoResponseError."""
        found = self.reports([name], self._deadline)[name]
        if found is None:
            raise self._no_response_error(name)
        return found

    def reports(self, names: Iterable[str], deadline: Deadline) -> dict[str, SystemReport | None]:
        """Return the reports that arrive before the deadline, None for the other systems."""
        requested = sorted(names)
        self._wait_for_reports(requested, deadline)
        return {name: self._report(name) if name in self._states else None for name in requested}

    def newer(self, name: str, than_s: float) -> SystemReport | None:
        """Return the report of a system if its callbacks are newer than ``than_s``, else None."""
        if _time_s(self._callbacks[name]) <= than_s:
            return None
        return self._report(name)

    def command(self, name: str, command: str) -> tuple[bool, str]:
        """Call a service of a manager; return whether it succeeded, and its message.

        ``command`` is a service of :class:`composer.runtime.manager.node.ManagerNode`. Raises
        NoResponseError.
        """
        limit = _ProcessDeadline(name, self._deadline)
        # A report proves that the process is alive: the services of a killed process remain in the
        # graph for a while.
        discovery = _ProcessDeadline(name, Deadline(min(DISCOVERY_S, limit.left_s)))
        if not self._wait_for_reports((name,), discovery):
            raise self._no_response_error(name)
        service = f"{name}/{NAME}/{command}"
        try:
            response = call_once(self._session, Trigger, service, Trigger.Request(), limit)
        except NoResponseError as error:
            if limit.has_process_ended:
                raise NoResponseError(f"{name} did not {command}: its process has ended") from error
            raise NoResponseError(
                f"{name} did not {command} within {self._deadline.timeout_s:g} s",
                "it may still be in progress: see 'compose ps'. Use --timeout to wait longer",
            ) from error
        return bool(response.success), str(response.message)

    def shut_down(self, name: str) -> str:
        """Shut down a system and its process; return its message. Raises NoResponseError."""
        is_local = name in local_systems()
        _, message = self.command(name, "shutdown")
        if is_local:
            self._session.wait_for(lambda: name not in local_systems() or None, self._deadline)
        return message

    def _wait_for_reports(self, names: Collection[str], deadline: Deadline) -> bool:
        """Wait for the reports of all systems; return whether all have arrived."""
        self.subscribe(names)
        return bool(
            self._session.wait_for(lambda: all(map(self._has_reported, names)) or None, deadline)
        )

    def _no_response_error(self, name: str) -> NoResponseError:
        pid = local_systems().get(name)
        where = "its process may be busy or gone" if pid is None else f"its process is {pid}"
        return NoResponseError(
            f"{name}/{NAME} did not respond within {self._deadline.timeout_s:g} s",
            f"{where}. Use --timeout to wait longer",
        )

    def _has_reported(self, name: str) -> bool:
        return name in self._states and (not self._with_callbacks or name in self._callbacks)

    def _report(self, name: str) -> SystemReport:
        report = _system_report(name, self._states[name])
        callbacks = self._callbacks.get(name)
        if callbacks is None:
            return report
        found, chains = from_message(callbacks)
        at_s = _time_s(callbacks)
        return replace(report, callbacks=found, chains=chains, callbacks_at_s=at_s)

    def _subscribe(self, name: str) -> list[Subscription]:
        subscriptions = [self._stored_in(self._states, name, STATE_TOPIC, STATE_QOS)]
        if self._with_callbacks:
            subscriptions.append(
                self._stored_in(self._callbacks, name, CALLBACKS_TOPIC, CALLBACKS_QOS)
            )
        return subscriptions

    def _stored_in(
        self, messages: dict[str, DiagnosticArray], name: str, topic: str, qos: QoSProfile
    ) -> Subscription:
        """Return a subscription that keeps the last message of a system in ``messages``."""
        return self._session.node.create_subscription(
            DiagnosticArray,
            f"{name}/{NAME}/{topic}",
            lambda message: messages.__setitem__(name, message),
            qos,
        )


class _ProcessDeadline(Deadline):
    """A time limit that ends early if the process of a system on this computer ends."""

    def __init__(self, system: str, limit: Deadline) -> None:
        super().__init__(limit.left_s)
        self._system = system
        self._is_local = system in local_systems()
        self._last_messages: Deadline | None = None

    @property
    def left_s(self) -> float:
        """The remaining seconds, with some time for the last messages of an ended process."""
        if self._last_messages is None and self.has_process_ended:
            self._last_messages = Deadline(min(_LAST_MESSAGES_S, super().left_s))
        return super().left_s if self._last_messages is None else self._last_messages.left_s

    @property
    def has_process_ended(self) -> bool:
        """Whether the process has ended."""
        return self._is_local and self._system not in local_systems()


def _time_s(message: DiagnosticArray) -> float:
    stamp = message.header.stamp
    return float(stamp.sec + stamp.nanosec * 1e-9)


def _matches(name: str, systems: Iterable[str]) -> list[str]:
    """Return the systems with that full name or last part."""
    return [system for system in systems if system == name or system.endswith(f"/{name}")]


def _system_report(name: str, message: DiagnosticArray) -> SystemReport:
    system, *nodes = message.status
    values = _values(system)
    return SystemReport(
        name=name,
        activity=values["activity"],
        message=str(system.message),
        host=values["host"],
        pid=values["pid"],
        nodes=tuple(map(_node_report, nodes)),
    )


def _node_report(status: DiagnosticStatus) -> NodeReport:
    values = _values(status)
    return NodeReport(
        node=str(status.name).partition(": ")[2],
        state=values["state"],
        desired=values["desired"],
        since_s=float(values["since"]),
        restarts=int(values["restarts"]),
        errors=int(values["errors"]),
        last_error=values["last_error"],
        held_down=values["held_down"],
        sent_hz=float(values["sent_hz"]),
        received_hz=float(values["received_hz"]),
        busy=float(values["busy"]),
        slowest=values["slowest"],
        overruns=int(values["overruns"]),
        queue_drops=int(values["queue_drops"]),
        qos_events=_counts(values["qos_events"]),
    )


def _counts(text: str) -> dict[str, int]:
    """Parse counts by name, such as ``incompatible=1``."""
    pairs = (item.partition("=") for item in text.split())
    return {name: int(count) for name, _, count in pairs}


def _values(status: DiagnosticStatus) -> dict[str, str]:
    return {item.key: item.value for item in status.values}
