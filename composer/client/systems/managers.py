"""Running systems: reports and commands through their manager nodes."""

from __future__ import annotations

import time
from collections import defaultdict, deque
from collections.abc import Callable, Collection, Iterable
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.base.characters import visible
from composer.client.graph_names import NotFoundError, not_found_error, only_match
from composer.client.requests import ServiceCaller
from composer.client.session import Deadline, NoResponseError, Session
from composer.client.systems.local_queries import parse_state, systems_with, with_processes
from composer.model.names import is_selected
from composer.runtime.process.instance_lock import is_held, local_systems
from composer.runtime.protocol.codec import OtherVersionError, ProtocolError, decode
from composer.runtime.protocol.reports import SystemReport, TimingReport
from composer.runtime.protocol.requests import (
    CALLBACKS_TOPIC,
    NAME,
    REQUEST,
    STATE_TOPIC,
    Done,
    Restart,
    SaveRecording,
)
from composer.runtime.ros.service_requests import (
    CALLBACKS_QOS,
    STATE_QOS,
    RequestService,
    read_answer,
    request_message,
)

T = TypeVar("T")

#: Fast DDS discovers a participant at once or within 3 s; managers report every second.
DISCOVERY_S = 3.5
#: Managers publish their last report to each new subscription, and again every second.
REPORT_WITHIN_S = 2.0
#: Managers send a new report once the subscription has received the latched one, which may be old,
#: and at the latest within a second.
_FRESH_WITHIN_S = 1.5
#: How long to wait for the last messages of a process that has ended.
_LAST_MESSAGES_S = 0.1


class Systems:
    """Queries and commands managers, all within one time limit.

    With ``callbacks``, reports include callbacks and chains.
    """

    def __init__(
        self,
        session: Session,
        deadline: Deadline,
        *,
        callbacks: bool = False,
        on_report: Callable[[], None] | None = None,
    ) -> None:
        """``on_report`` is called for each report that arrives, on the thread of its callback."""
        self._session = session
        self._deadline = deadline
        self._with_callbacks = callbacks
        self._on_report = on_report
        self._states: dict[str, SystemReport] = {}
        self._other_versions: dict[str, OtherVersionError] = {}
        self._callbacks: dict[str, TimingReport] = {}
        self._arrivals_s: defaultdict[str, deque[float]] = defaultdict(lambda: deque(maxlen=2))
        self._subscriptions: dict[str, list[Subscription]] = {}

    def discover(self) -> tuple[str, ...]:
        """Return the names of all systems discovered so far, and subscribe to their reports."""
        found = tuple(sorted(systems_with(self._session.graph.services())))
        self.subscribe(found)
        return found

    def subscribe(self, names: Iterable[str]) -> None:
        """Subscribe to the reports of systems, which need not be discovered yet."""
        for name in names:
            if name not in self._subscriptions:
                self._subscriptions[name] = self._subscribe(name)

    def find(self, name: str) -> str:
        """Return the full name of a running system. Raises NotFoundError."""
        found = [system for system in local_systems() if is_selected(system, name)]
        if not found:
            discovered = self._session.wait_until_settled(self.discover, self._deadline)
            known = sorted({*local_systems(), *discovered})
            found = [system for system in known if is_selected(system, name)]
        if not found:
            error = not_found_error("running system", name, known)
            none = "no system is running: start one with 'compose run'"
            raise NotFoundError(str(error), error.hint if known else none)
        return only_match("system", name, found)

    def only(self) -> str:
        """Return the full name of the only running system. Raises NotFoundError."""
        names: Iterable[str] = local_systems()
        names = names or self._session.wait_until_settled(self.discover, self._deadline)
        known = without_members(names)
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

    def whole(self, report: SystemReport) -> SystemReport:
        """Return a report with the callbacks of the other processes of its system.

        The first call waits until they have reported.
        """
        names = report.processes
        if not self._subscriptions.keys() >= set(names.values()):
            self.reports(names.values(), self._deadline.at_most(DISCOVERY_S))
        known = {process: name for process, name in names.items() if self._has_reported(name)}
        return with_processes(report, {key: self._report(name) for key, name in known.items()})

    def reports(self, names: Iterable[str], deadline: Deadline) -> dict[str, SystemReport | None]:
        """Return the reports that arrive before the deadline, None for the other systems."""
        requested = sorted(names)
        self._wait_for_reports(requested, deadline)
        self._session.wait_for(lambda: all(map(self._is_fresh, requested)), deadline)
        return {name: self._report(name) if name in self._states else None for name in requested}

    def other_version(self, name: str) -> OtherVersionError | None:
        """Return the error of a system of another version, which says what to update."""
        return self._other_versions.get(name)

    def current(self) -> dict[str, SystemReport | None]:
        """Return the last report of each system that is subscribed to, None before the first."""
        return {
            name: self._report(name) if self._has_reported(name) else None
            for name in tuple(self._subscriptions)
        }

    def forget(self, names: Iterable[str]) -> None:
        """Destroy the subscriptions to systems that have ended."""
        for name in names:
            for subscription in self._subscriptions.pop(name, ()):
                self._session.node.destroy_subscription(subscription)
            for reports in (self._states, self._other_versions, self._callbacks, self._arrivals_s):
                reports.pop(name, None)

    def close(self) -> None:
        """Destroy all subscriptions."""
        self.forget(tuple(self._subscriptions))

    def command(self, name: str, command: str) -> tuple[bool, str]:
        """Call a service of a manager; return whether it succeeded, and its message.

        ``command`` is a service of :class:`composer.runtime.manager.node.ManagerNode`. Raises
        NoResponseError.
        """
        response = self._call(name, command, Trigger, Trigger.Request(), command)
        return bool(response.success), str(response.message)

    def restart(self, name: str, nodes: Iterable[str]) -> tuple[bool, str]:
        """Restart nodes of a system; return whether it succeeded, and the message of the manager.

        ``nodes`` are full names. Raises NoResponseError.
        """
        return self._request(name, Restart(tuple(nodes)), "restart")

    def save_recording(self, name: str) -> tuple[bool, str]:
        """Let a flight recorder write; return whether it did, and the folder or why not.

        Raises NoResponseError.
        """
        return self._request(name, SaveRecording(), "record")

    def _request(
        self, name: str, request: Restart | SaveRecording, command: str
    ) -> tuple[bool, str]:
        message = request_message(request)
        try:
            done: Done = read_answer(
                self._call(name, REQUEST, RequestService, message, command), request
            )
        except ProtocolError as error:
            raise NoResponseError(f"{name} refused the request: {error}") from error
        return done.success, done.message

    def shut_down(self, name: str) -> str:
        """Shut down a system and its process; return its message. Raises NoResponseError."""
        is_local = is_held(name)
        _, message = self.command(name, "shutdown")
        if is_local:
            self._session.wait_for(lambda: not is_held(name), self._deadline)
        return message

    def _call(self, name: str, service: str, kind: Any, request: Any, command: str) -> Any:
        """Return the response of a service of a manager. Raises NoResponseError."""
        limit = _ProcessDeadline(name, self._deadline)
        # A report proves that the process is alive: the services of a killed process remain in the
        # graph for a while.
        discovery = _ProcessDeadline(name, limit.at_most(DISCOVERY_S))
        if not self._wait_for_reports((name,), discovery):
            raise self._no_response_error(name)
        full_name = f"{name}/{NAME}/{service}"
        try:
            with closing(ServiceCaller(self._session)) as caller:
                return caller.call_once(kind, full_name, request, limit)
        except NoResponseError as error:
            if limit.has_process_ended:
                raise NoResponseError(f"{name} did not {command}: its process has ended") from error
            raise NoResponseError(
                f"{name} did not {command} within {self._deadline.timeout_s:g} s",
                "it may still be in progress: see 'compose ps'. Use --timeout to wait longer",
            ) from error

    def _wait_for_reports(self, names: Collection[str], deadline: Deadline) -> bool:
        """Wait for the reports of all systems; return whether all have arrived."""
        self.subscribe(names)
        return self._session.wait_for(lambda: all(map(self._has_reported, names)), deadline)

    def _no_response_error(self, name: str) -> NoResponseError:
        if name in self._other_versions:
            return NoResponseError(f"{name}/{NAME}: {self._other_versions[name]}")
        pid = local_systems().get(name)
        where = "its process may be busy or gone" if pid is None else f"its process is {pid}"
        return NoResponseError(
            f"{name}/{NAME} did not respond within {self._deadline.timeout_s:g} s",
            f"{where}. Use --timeout to wait longer",
        )

    def _has_reported(self, name: str) -> bool:
        return name in self._states and (not self._with_callbacks or name in self._callbacks)

    def _is_fresh(self, name: str) -> bool:
        """Return whether a latched report, which may be old, was followed by a new one."""
        arrivals_s = self._arrivals_s.get(name, ())
        return (
            len(arrivals_s) > 1
            or not arrivals_s
            or time.monotonic() > arrivals_s[0] + _FRESH_WITHIN_S
        )

    def _report(self, name: str) -> SystemReport:
        report = self._states[name]
        found = self._callbacks.get(name)
        if found is None:
            return report
        return replace(
            report, callbacks=found.callbacks, chains=found.chains, callbacks_at_s=found.at_s
        )

    def _subscribe(self, name: str) -> list[Subscription]:
        parse = partial(parse_state, name)
        subscriptions = [self._stored_in(self._states, name, STATE_TOPIC, STATE_QOS, parse)]
        if self._with_callbacks:
            subscriptions.append(
                self._stored_in(
                    self._callbacks,
                    name,
                    CALLBACKS_TOPIC,
                    CALLBACKS_QOS,
                    lambda text: decode(text, TimingReport, clean=visible),
                )
            )
        return subscriptions

    def _stored_in(
        self,
        reports: dict[str, T],
        name: str,
        topic: str,
        qos: QoSProfile,
        parse: Callable[[str], T],
    ) -> Subscription:
        """Return a subscription that keeps the last valid report of a system in ``reports``."""
        full_topic = f"{name}/{NAME}/{topic}"
        is_state = topic == STATE_TOPIC

        def on_message(message: String) -> None:
            if is_state:
                self._arrivals_s[name].append(time.monotonic())
            try:
                reports[name] = parse(message.data)
            except OtherVersionError as error:
                self._other_versions[name] = error
            except ProtocolError as error:
                reason = f"it is not a report of this version: {error}"
                self._session.graph.skipped.add(reason, f"a message on {full_topic}")
            if self._on_report is not None and is_state:
                self._on_report()

        return self._session.node.create_subscription(String, full_topic, on_message, qos)


class _ProcessDeadline(Deadline):
    """A time limit that ends early if the process of a system on this computer ends."""

    def __init__(self, system: str, limit: Deadline) -> None:
        super().__init__(limit.left_s)
        self._system = system
        self._is_local = is_held(system)
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
        return self._is_local and not is_held(self._system)


def without_members(systems: Iterable[str]) -> list[str]:
    """Return the systems without those that are processes of another one in the list."""
    names = sorted(systems)
    return [name for name in names if name.rpartition("/")[0] not in names]
