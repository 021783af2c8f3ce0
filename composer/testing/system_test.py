"""Drives a whole system in virtual time, from the thread of a test.

::

    with SystemTest("systems/pipeline.yaml") as system:      # all nodes are active
        system.advance(2.0)                                   # takes milliseconds
        assert system.messages("/motor_commands")
        system.transition("planner", "deactivate")
        system.run_until(lambda: system.states["planner"] == "inactive", 1.0)

The test takes part in the system as a node of its own, :mod:`.tester`. While its thread is not in
a method of this class, nothing in the system runs.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from composer.base.diagnostics import has_errors, suggestion
from composer.base.fast_dataclass import dataclass
from composer.language.tree_values import word
from composer.loading import load_models
from composer.model import LogLevel, ParameterType, PortKind, System
from composer.model.names import PROGRAM_LOGGER
from composer.model.resolve import OverrideOptions
from composer.plan import bring_up, tear_down
from composer.report.text import render
from composer.runtime.clock.clock import COMPUTER, Clock
from composer.runtime.clock.virtual import VirtualClock
from composer.runtime.executors.futures import Future
from composer.runtime.host import Host
from composer.runtime.host_options import HostOptions
from composer.runtime.node.managed_node import InProcessNode, ManagedNode
from composer.runtime.node.node import RunningNode
from composer.runtime.protocol.reports import ChainFigures
from composer.runtime.ros.messages import MessageError, convert_message, to_plain
from composer.runtime.supervision.events import BroughtUp, Event, Logged, Outcome
from composer.runtime.supervision.virtual_time import ISOLATION
from composer.testing import faults
from composer.testing.failures import TestFailure, Timeline, short
from composer.testing.faults import Faults, TopicFault
from composer.testing.tester import TESTER, Tester, port_name, with_tester

#: The limit of the bring-up, in the time of the system.
_UP_WITHIN_S = 60.0
#: The longest real time in which a system that ends has to end.
_ENDS_WITHIN_S = 10.0
_POLL_S = 0.001
_PARAMETER_WITHIN_S = 5.0
#: Nodes of a system in real time on this domain do not meet those of others on this computer.
_DOMAINS = 100

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Received:
    """A message of a topic; ``time_s`` are the seconds since the start of the run."""

    time_s: float
    message: Any


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line of the log; ``node`` is the full name of a node, or empty for the system itself."""

    time_s: float
    level: LogLevel
    node: str
    text: str


class Goal:
    """A goal that a test has sent."""

    def __init__(
        self, test: SystemTest, action: str, sent: Future[Any], feedback: Sequence[Any]
    ) -> None:
        self._test = test
        self._action = action
        self._sent = sent
        self._outcome: Future[Any] | None = None
        #: The feedback so far.
        self.feedback = feedback

    @property
    def is_accepted(self) -> bool | None:
        """Whether the server has accepted the goal; None as long as it has not answered."""
        if not self._sent.done():
            return None
        return self._sent.exception() is None

    def result(self, timeout_s: float = 60.0) -> Any:
        """Wait for the result; it has ``status`` and ``result``.

        Raises TestFailure after ``timeout_s``, and what the call raises, such as GoalRejected.
        """
        if self._outcome is None:
            sent = self._test.wait_for(self._sent, timeout_s, f"an answer of {self._action}")
            self._outcome = sent.result()
        return self._test.wait_for(self._outcome, timeout_s, f"the result of {self._action}")

    def cancel(self, timeout_s: float = 5.0) -> bool:
        """Request to cancel the goal; return whether the server accepts that."""
        sent = self._test.wait_for(self._sent, timeout_s, f"an answer of {self._action}")
        what = f"{self._action} to cancel the goal"
        return bool(self._test.wait_for(sent.cancel(), timeout_s, what))


class SystemTest:
    """One run of a system. Use it as a context manager, once.

    ``system`` is a file, or a model that is already loaded. ``arguments`` are those of the system,
    ``settings`` values of parameters by ``node.parameter``. With ``real_time``, the system has the
    time of the computer.
    """

    __test__ = False  # no class of tests

    def __init__(
        self,
        system: Path | str | System,
        *,
        arguments: Mapping[str, Any] | None = None,
        settings: Mapping[str, Any] | None = None,
        real_time: bool = False,
        log_level: LogLevel = LogLevel.INFO,
    ) -> None:
        """Raise TestFailure if the file cannot be read or has errors."""
        if not isinstance(system, System):
            system = _loaded(Path(system), arguments or {}, settings or {})
        self._system = with_tester(system)
        self._is_real = real_time
        self._log_level = log_level
        self._timeline = Timeline()
        self._tester: Tester
        self._received: dict[str, list[Received]] = {}
        self._log: list[LogLine] = []
        self._events: list[Event] = []
        self._error: BaseException | None = None
        self._is_up = False
        self._outcome: Outcome | None = None

    def __enter__(self) -> Self:
        """Bring the system up. Raises StartRefused if it cannot run here, and TestFailure."""
        self._variables = dict(os.environ)
        os.environ.update(ISOLATION)
        if self._is_real:
            os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % _DOMAINS)
        self._clock: Clock = COMPUTER if self._is_real else VirtualClock()
        self._start_s = self._clock.monotonic()
        tester = self._system.node(TESTER)
        ports = () if tester is None else tester.ports
        self._faults = Faults(self._clock, ports, self._on_tester)
        options = HostOptions(
            log_level=self._log_level,
            clock=self._clock,
            instruments=self._faults,
            bring_up_within_s=_UP_WITHIN_S,
        )
        up, down = bring_up(self._system), tear_down(self._system)
        self._host = Host(self._system, up, down, options, self._on_event)
        self._thread = threading.Thread(target=self._run, name="system", daemon=True)
        self._clock.start(self._thread)
        self._wait(lambda: self._is_up or self._outcome is not None, inf)
        if not self._is_up:
            self._end()
            if self._error is not None:
                raise self._error
            raise self._failure("the system did not come up")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Shut the system down. Raises TestFailure if it does not end."""
        self._host.stop("end of the test")
        self._end()
        if kind is None and self._error is not None:
            raise self._error

    # --- time

    @property
    def now_s(self) -> float:
        """The seconds since the start of the run."""
        return self._clock.monotonic() - self._start_s

    def advance(self, seconds: float) -> None:
        """Let the system run for this time."""
        self._clock.sleep(seconds)

    def run_until(self, condition: Callable[[], object], timeout_s: float) -> None:
        """Let the system run until ``condition()``, which is checked after each of its steps.

        Raises TestFailure after ``timeout_s``, and what ``condition`` raises.
        """
        if not self._wait(condition, timeout_s):
            name = getattr(condition, "__name__", "<lambda>")
            what = "the condition was" if name == "<lambda>" else f"{name} was"
            raise self._failure(f"{what} not true within {timeout_s:g} s")

    # --- what the system does

    @property
    def states(self) -> Mapping[str, str]:
        """The lifecycle states of the nodes, by their keys in the file."""
        nodes = self._host.nodes.items()
        return {name: node.state for name, node in nodes if name != TESTER}

    @property
    def log(self) -> Sequence[LogLine]:
        """The lines of the log so far."""
        return tuple(self._log)

    @property
    def events(self) -> Sequence[Event]:
        """What was reported so far, except for lines of the log."""
        return tuple(self._events)

    @property
    def latencies(self) -> Mapping[str, ChainFigures]:
        """The latencies of the chains so far, by their names."""
        return {figures.chain: figures for figures in self._host.chains()}

    @property
    def outcome(self) -> Outcome | None:
        """How the run has ended; None while it lasts."""
        return self._outcome

    def messages(self, topic: str) -> Sequence[Received]:
        """Return the messages on a topic so far.

        Raises TestFailure for a topic that no node publishes.
        """
        self._port(PortKind.SUBSCRIPTION, topic)
        return tuple(self._received.get(topic, ()))

    def timeline(self) -> list[str]:
        """Return the last events, messages and lines of the log, each with its time."""
        return self._timeline.lines()

    # --- what the test does

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message of the topic's type, or a mapping with values of its fields.

        Raises TestFailure for a topic without subscription, MessageError for wrong values.
        """
        publisher = self._tester.publishers[self._port(PortKind.PUBLISHER, topic)]
        converted = _converted(message, publisher.message_type, topic)
        self._did(f"published {short(to_plain(converted))} on {topic}")
        publisher.publish(converted)

    def call(self, service: str, request: Any = None, timeout_s: float = 5.0) -> Any:
        """Call a service and return the response.

        Raises MessageError for wrong values, TestFailure for a name without server, or if there is
        no response within ``timeout_s``.
        """
        response = self.call_soon(service, request, timeout_s)
        return self.wait_for(response, timeout_s, f"a response of {service}")

    def call_soon(self, service: str, request: Any = None, timeout_s: float = 5.0) -> Future[Any]:
        """Call a service and return the future of the response."""
        client = self._tester.clients[self._port(PortKind.CLIENT, service)]
        converted = _converted(request or {}, client.service_type.Request, service)
        self._did(f"called {service} with {short(to_plain(converted))}")
        called: Future[Any] = client.call(converted, timeout_ms=timeout_s * 1000.0)
        return called

    def send_goal(self, action: str, goal: Any = None) -> Goal:
        """Send a goal.

        Raises TestFailure for a name without server, MessageError for wrong values.
        """
        client = self._tester.action_clients[self._port(PortKind.ACTION_CLIENT, action)]
        converted = _converted(goal or {}, client.action_type.Goal, action)
        self._did(f"sent {short(to_plain(converted))} to {action}")
        feedback: list[Any] = []
        sent = client.send_goal(converted, on_feedback=feedback.append)
        return Goal(self, action, sent, feedback)

    def set_parameter(self, node: str, name: str, value: Any) -> None:
        """Set a parameter. Raises TestFailure if it is refused."""
        found = self._node(node)
        if not isinstance(found, InProcessNode):
            raise self._failure(f"{node} does not run in this process")
        self._did(f"set {node}.{name} to {short(value)}")
        declared = {item.name.value: item.type.value for item in found.model.parameters}
        if declared.get(name) == ParameterType.DOUBLE and type(value) is int:
            value = float(value)
        message = Parameter(name, value=value).to_parameter_msg()
        answer = found.parameter_services.answer(
            "set_parameters", SetParameters.Request(parameters=[message]), SetParameters.Response()
        )
        (result,) = self._run_on(
            found, answer, _PARAMETER_WITHIN_S, f"{node} to set {name}"
        ).results
        if not result.successful:
            raise self._failure(f"{node} refused {name} = {value!r}: {result.reason}")

    def transition(self, node: str, transition: str, timeout_s: float = 60.0) -> None:
        """Run a transition, such as "deactivate". Raises TestFailure if it does not succeed."""
        found = self._node(node)
        self._did(f"requested '{transition}' of {node}")
        what = f"'{transition}' of {node}"
        outcome = self._run_on(found, found.lifecycle.change(transition), timeout_s, what)
        if not outcome.success:
            raise self._failure(f"{what} failed: {outcome.reason}")

    # --- faults

    def drop(self, topic: str, count: float = inf, for_s: float = inf) -> None:
        """Lose the next ``count`` messages on a topic, at most for this time."""
        self._disturb(topic, faults.drop, count, for_s, "drop")

    def delay(self, topic: str, delay_s: float, count: float = inf, for_s: float = inf) -> None:
        """Deliver messages on a topic late."""
        fault = faults.delayed(delay_s, self._host.nodes[TESTER].loop.call_later)
        self._disturb(topic, fault, count, for_s, f"delay by {delay_s:g} s")

    def duplicate(self, topic: str, count: float = inf, for_s: float = inf) -> None:
        """Deliver messages on a topic twice."""
        self._disturb(topic, faults.duplicate, count, for_s, "duplicate")

    def reorder(self, topic: str, count: float = inf, for_s: float = inf) -> None:
        """Swap each two messages on a topic."""
        self._disturb(topic, faults.reordered(), count, for_s, "reorder")

    def corrupt(
        self,
        topic: str,
        change: Callable[[Any], object],
        count: float = inf,
        for_s: float = inf,
    ) -> None:
        """Deliver what ``change`` makes of a copy of each message on a topic."""
        self._disturb(topic, faults.corrupted(change), count, for_s, "corrupt")

    def end_faults(self, topic: str) -> None:
        """End the faults of a topic."""
        self._did(f"end the faults of {topic}")
        self._faults.end(topic)

    def raise_in(self, node: str, handler: str | None = None, error: str = "injected") -> None:
        """Let the next call of a handler, such as "on_tick", raise RuntimeError; None for any."""

        def fail() -> None:
            raise RuntimeError(error)

        self._before_handler(node, handler, fail, "raise an exception")

    def hang(self, node: str, seconds: float, handler: str | None = None) -> None:
        """Let the next call of a handler block its executor for this time."""
        self._before_handler(node, handler, partial(self._clock.sleep, seconds), "hang")

    def kill(self, node: str, reason: str = "killed by the test") -> None:
        """Let a node fail, so that its ``on_failure`` applies."""
        found = self._node(node)
        if not isinstance(found, RunningNode):
            raise self._failure(f"{node} does not run in this process")
        self._did(f"let {node} fail")
        found.loop.call_soon(partial(found.fail, reason))

    # --- waiting for what runs on a loop

    def wait_for(self, future: Future[T], timeout_s: float, what: str) -> T:
        """Let the system run until the future is done; return its result.

        Raises TestFailure after ``timeout_s``, and the exception of the future.
        """
        if not self._wait(future.done, timeout_s):
            future.cancel()
            raise self._failure(f"waited {timeout_s:g} s for {what}")
        return future.result()

    def _run_on(
        self, node: ManagedNode, coroutine: Coroutine[Any, Any, T], timeout_s: float, what: str
    ) -> T:
        return self.wait_for(node.loop.run_task(coroutine), timeout_s, what)

    def _wait(self, condition: Callable[[], object], timeout_s: float) -> bool:
        """Let the system run until ``condition()``; return its value. Raises what it raises."""
        errors: list[BaseException] = []

        def is_over() -> bool:
            try:
                return bool(errors) or bool(condition())
            except BaseException as error:  # not on the thread that happens to check it
                errors.append(error)
                return True

        until_s = self._clock.monotonic() + timeout_s
        if isinstance(self._clock, VirtualClock):
            is_true = self._clock.wait_until(is_over, until_s)
        else:
            while not (is_true := is_over()) and self._clock.monotonic() < until_s:
                self._clock.sleep(_POLL_S)
        if errors:
            raise errors[0]
        return is_true

    # --- the thread of the system

    def _run(self) -> None:
        try:
            self._outcome = self._host.run()
        except BaseException as error:  # raised again on the thread of the test
            self._error = error
            self._outcome = Outcome(1, str(error), self.now_s, ())

    def _end(self) -> None:
        self._clock.join(self._thread, _ENDS_WITHIN_S)
        os.environ.clear()
        os.environ.update(self._variables)
        if self._outcome is None:
            raise self._failure("the system did not end")

    def _on_event(self, event: Event) -> None:
        is_of_test = TESTER in (getattr(event, "node", ""), getattr(event, "logger", ""))
        if is_of_test or getattr(event, "node", "") == f"/{TESTER}":
            return
        if isinstance(event, Logged):
            node = "" if event.logger == PROGRAM_LOGGER else f"/{event.logger.replace('.', '/')}"
            self._log.append(LogLine(event.elapsed_s, event.level, node, event.message))
        else:
            if isinstance(event, BroughtUp):
                event = replace(event, active=event.active - 1, nodes=event.nodes - 1)
                self._is_up = True
            self._events.append(event)
        self._timeline.add(event.elapsed_s, partial(_text, event))

    def _on_tester(self, tester: Tester) -> None:
        self._tester = tester
        tester.on_message = self._on_message

    def _on_message(self, topic: str, message: Any) -> None:
        received = Received(self.now_s, message)
        self._received.setdefault(topic, []).append(received)
        self._timeline.add(received.time_s, lambda: f"{topic}: {short(to_plain(message))}")

    # --- names

    def _node(self, name: str) -> ManagedNode:
        nodes = {key: node for key, node in self._host.nodes.items() if key != TESTER}
        by_name = {node.full_name: node for node in nodes.values()} | nodes
        if name not in by_name:
            raise self._unknown(f"the system has no node '{name}'", name, nodes)
        return by_name[name]

    def _port(self, kind: PortKind, full_name: str) -> str:
        name = port_name(kind, full_name)
        tester = self._host.nodes[TESTER].model
        if tester.port(name) is None:
            names = [port.full_name for port in tester.ports if port.kind is kind]
            text = f"no node of the system has a {_OTHER_ENDS[kind]} '{full_name}'"
            raise self._unknown(text, full_name, names)
        return name

    def _disturb(
        self, topic: str, disturb: faults.Disturb, count: float, for_s: float, what: str
    ) -> None:
        self._port(PortKind.PUBLISHER, topic)  # there is a subscription
        self._did(f"{what}: {topic}")
        until_s = self._clock.monotonic() + for_s
        self._faults.add(topic, TopicFault(disturb, count, until_s))

    def _before_handler(
        self, node: str, handler: str | None, act: Callable[[], None], what: str
    ) -> None:
        model = self._node(node).model
        if model.behavior is None:
            raise self._failure(f"{node} has no behavior that could {what}")
        self._did(f"let {node} {what}")
        self._faults.before_next_handler(model.name.value, handler, act)

    def _did(self, text: str) -> None:
        self._timeline.add(self.now_s, lambda: f"test: {text}")

    def _unknown(self, text: str, name: str, names: Iterable[str]) -> TestFailure:
        hint = suggestion(name, list(names))
        return TestFailure(text if hint is None else f"{text}; {hint}")

    def _failure(self, text: str) -> TestFailure:
        if self._outcome is not None:
            text = f"{text}; the system has ended: {self._outcome.reason}"
        return TestFailure(text, self.timeline())


_OTHER_ENDS = {
    PortKind.SUBSCRIPTION: "publisher on",
    PortKind.PUBLISHER: "subscription to",
    PortKind.CLIENT: "service",
    PortKind.ACTION_CLIENT: "action server",
}


def _text(event: Event) -> str:
    if isinstance(event, Logged):
        return f"[{event.level.upper()}] [{event.logger}] {event.message}"
    return str(event)


def _converted(content: Any, kind: Any, where: str) -> Any:
    if isinstance(content, Mapping):
        return convert_message(content, kind, where)
    if not isinstance(content, kind):
        raise MessageError(f"{where} takes a {kind.__name__}, not {type(content).__name__}")
    return content


def _loaded(path: Path, arguments: Mapping[str, Any], settings: Mapping[str, Any]) -> System:
    overrides = OverrideOptions(
        arguments=tuple(f"{name}={word(value)}" for name, value in arguments.items()),
        settings=tuple(f"{name}={word(value)}" for name, value in settings.items()),
    )
    [result] = load_models([path], overrides)
    if result.system is None or has_errors(result.diagnostics):
        raise TestFailure(f"{path} has errors:\n{render(result.diagnostics)}")
    return result.system
