"""Running systems, asked from another process by way of their manager nodes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from std_srvs.srv import Trigger

from composer.remote.name_matching import NotThere, not_there
from composer.remote.requests import call_once
from composer.remote.session import Deadline, NoAnswer, Session
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
#: Managers tell at once and again each second; who is not met at once is met within 3 s.
MEETING_S = 3.5

_LAST_WORDS_S = 0.1


@dataclass(frozen=True, slots=True)
class NodeReport:
    """A node as its system's manager tells of it. ``since_s`` is in seconds since 1970."""

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
    """A system as its manager tells of it. ``name`` is the namespace of that.

    ``callbacks`` and ``chains`` are there where asked for, as they were at ``callbacks_at_s``.
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
    """Asks managers, all within one time limit; ``callbacks`` says whether for those, too."""

    def __init__(self, session: Session, deadline: Deadline, *, callbacks: bool = False) -> None:
        self._session = session
        self._deadline = deadline
        self._wants_callbacks = callbacks
        self._heard: dict[str, DiagnosticArray] = {}
        self._callbacks: dict[str, DiagnosticArray] = {}
        self._subscriptions: dict[str, list[Subscription]] = {}

    def look(self) -> tuple[str, ...]:
        """Return the names of all systems known now, and listen for what they tell.

        The name is the namespace of the manager: ``/pipeline``, ``/robot1/pipeline``.
        """
        found = tuple(
            sorted(
                name.removesuffix(_SERVICE)
                for name, types in self._session.node.get_service_names_and_types()
                if name.endswith(_SERVICE) and _TRIGGER_TYPE in types
            )
        )
        self.listen(found)
        return found

    def listen(self, names: Iterable[str]) -> None:
        """Listen for what systems tell, also of those that are not discovered yet."""
        for name in names:
            if name not in self._subscriptions:
                self._subscriptions[name] = self._listen(name)

    def find(self, name: str) -> str:
        """Return the full name of the running system that ``name`` means. Raises NotThere."""
        here = _called(name, local_systems())
        if not here:
            known = self._session.wait_until_still(self.look, self._deadline)
            here = _called(name, known)
        if not here:
            error = not_there("running system", name, (*local_systems(), *known))
            none = "no system is running: start one with 'compose run'"
            raise NotThere(str(error), error.hint if known else none)
        if len(here) > 1:
            raise NotThere(f"'{name}' is more than one system", f"say which: {', '.join(here)}")
        return here[0]

    def only(self) -> str:
        """Return the full name of the one system that runs. Raises NotThere."""
        known = sorted(local_systems()) or self._session.wait_until_still(self.look, self._deadline)
        if not known:
            raise NotThere("no system is running", "start one with 'compose run'")
        if len(known) > 1:
            raise NotThere("there is more than one system", f"say which: {', '.join(known)}")
        return known[0]

    def report(self, name: str) -> SystemReport:
        """Return what the manager of a system tells. Raises NoAnswer."""
        found = self.reports([name], self._deadline)[name]
        if found is None:
            raise self._silent(name)
        return found

    def reports(self, names: Iterable[str], patience: Deadline) -> dict[str, SystemReport | None]:
        """Return what the managers tell until then; None for one that tells nothing."""
        wanted = sorted(names)
        self._hear(wanted, patience)
        return {name: self._report(name) if name in self._heard else None for name in wanted}

    def newer(self, name: str, than_s: float) -> SystemReport | None:
        """Return the report of a system, if its callbacks are known as they were after a time."""
        if _time_s(self._callbacks[name]) <= than_s:
            return None
        return self._report(name)

    def command(self, name: str, what: str) -> tuple[bool, str]:
        """Have a system do something, and return whether it did and what it says. Raises NoAnswer.

        ``what`` is one of the services of :class:`composer.runtime.manager.node.ManagerNode`.
        """
        life = _Life(name, self._deadline)
        # Who tells its state is alive: of a killed process, services are in the graph for a while.
        if not self._hear((name,), _Life(name, Deadline(min(MEETING_S, life.left_s)))):
            raise self._silent(name)
        service = f"{name}/{NAME}/{what}"
        try:
            answer = call_once(self._session, Trigger, service, Trigger.Request(), life)
        except NoAnswer as error:
            if life.is_over:
                raise NoAnswer(f"{name} did not {what}: its process has ended") from error
            raise NoAnswer(
                f"{name} did not {what} within {self._deadline.timeout_s:g} s",
                "it may still be at it: 'compose ps' tells. --timeout waits longer",
            ) from error
        return bool(answer.success), str(answer.message)

    def end(self, name: str) -> str:
        """End a system and its process; return what it said. Raises NoAnswer."""
        was_here = name in local_systems()
        _, message = self.command(name, "shutdown")
        if was_here:
            self._session.wait_for(lambda: name not in local_systems() or None, self._deadline)
        return message

    def _hear(self, names: Collection[str], patience: Deadline) -> bool:
        """Wait until all managers have told their state, and say whether they have."""
        self.listen(names)
        return bool(
            self._session.wait_for(lambda: all(map(self._has_told, names)) or None, patience)
        )

    def _silent(self, name: str) -> NoAnswer:
        pid = local_systems().get(name)
        where = "its process may be busy or gone" if pid is None else f"its process is {pid}"
        return NoAnswer(
            f"{name}/{NAME} did not answer within {self._deadline.timeout_s:g} s",
            f"{where}. --timeout gives it longer",
        )

    def _has_told(self, name: str) -> bool:
        return name in self._heard and (not self._wants_callbacks or name in self._callbacks)

    def _report(self, name: str) -> SystemReport:
        report = _report(name, self._heard[name])
        callbacks = self._callbacks.get(name)
        if callbacks is None:
            return report
        found, chains = from_message(callbacks)
        at_s = _time_s(callbacks)
        return replace(report, callbacks=found, chains=chains, callbacks_at_s=at_s)

    def _listen(self, name: str) -> list[Subscription]:
        subscriptions = [self._heard_of(name, STATE_TOPIC, STATE_QOS, self._heard)]
        if self._wants_callbacks:
            subscriptions.append(
                self._heard_of(name, CALLBACKS_TOPIC, CALLBACKS_QOS, self._callbacks)
            )
        return subscriptions

    def _heard_of(
        self, name: str, topic: str, qos: QoSProfile, heard: dict[str, DiagnosticArray]
    ) -> Subscription:
        return self._session.node.create_subscription(
            DiagnosticArray,
            f"{name}/{NAME}/{topic}",
            lambda message: heard.__setitem__(name, message),
            qos,
        )


class _Life(Deadline):
    """A time limit that ends with the process of a system, where that runs on this computer."""

    def __init__(self, system: str, limit: Deadline) -> None:
        super().__init__(limit.left_s)
        self._system = system
        self._is_here = system in local_systems()
        self._last_words: Deadline | None = None

    @property
    def left_s(self) -> float:
        """The seconds that are left. What it said last still arrives."""
        if self._last_words is None and self.is_over:
            self._last_words = Deadline(min(_LAST_WORDS_S, super().left_s))
        return super().left_s if self._last_words is None else self._last_words.left_s

    @property
    def is_over(self) -> bool:
        """Whether the process has ended."""
        return self._is_here and self._system not in local_systems()


def _time_s(message: DiagnosticArray) -> float:
    stamp = message.header.stamp
    return float(stamp.sec + stamp.nanosec * 1e-9)


def _called(name: str, systems: Iterable[str]) -> list[str]:
    """Return the systems that ``name`` may mean."""
    return [system for system in systems if system == name or system.endswith(f"/{name}")]


def _report(name: str, message: DiagnosticArray) -> SystemReport:
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
    """Read counts by name: ``incompatible=1``."""
    pairs = (item.partition("=") for item in text.split())
    return {name: int(count) for name, _, count in pairs}


def _values(status: DiagnosticStatus) -> dict[str, str]:
    return {item.key: item.value for item in status.values}
