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

from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from math import inf
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar, Unpack

from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from composer.bags.editing import Selection
from composer.bags.reader import open_bag
from composer.bags.system_recording import SystemRecording
from composer.model import LogLevel, ParameterType, PortKind, System
from composer.model.names import matches_wildcard
from composer.model.recording import Recording
from composer.runtime.clock.clock import COMPUTER, Clock
from composer.runtime.clock.virtual import START_NS, VirtualClock
from composer.runtime.executors.futures import Future
from composer.runtime.host_options import HostOptions
from composer.runtime.node.local_node import LocalNode
from composer.runtime.node.managed_node import InProcessNode, ManagedNode
from composer.runtime.protocol.reports import ChainFigures
from composer.runtime.ros.messages import MessageError, convert_message, to_plain
from composer.runtime.supervision.events import Event, Outcome
from composer.testing import faults
from composer.testing.bag_messages import messages_of
from composer.testing.failures import LogLine, Received, TestFailure, short, unknown, unmet
from composer.testing.faults import Fault, Faults, Limits
from composer.testing.goals import Goal
from composer.testing.system_run import Answer, Observation, SystemRun, load_system
from composer.testing.tester import TESTER, Tester, port_to, with_tester

_PARAMETER_WITHIN_S = 5.0

T = TypeVar("T")


class SystemTest:
    """One run of a system. Use it as a context manager, once.

    ``system`` is a file, or a model that is already loaded. ``arguments`` are for the system,
    ``settings`` values of parameters by ``node.parameter``. With ``real_time``, the system has the
    time of the computer. Runs with the same ``seed`` have the same random numbers. Virtual time
    begins at ``start_ns`` (nanoseconds since 1970). ``record_to`` is the folder of a new bag, for
    what all nodes and the test publish.
    """

    __test__ = False  # no class of tests

    def __init__(
        self,
        system: Path | str | System,
        *,
        arguments: Mapping[str, Any] | None = None,
        settings: Mapping[str, Any] | None = None,
        seed: int = 0,
        real_time: bool = False,
        start_ns: int = START_NS,
        record_to: Path | None = None,
        log_level: LogLevel = LogLevel.INFO,
    ) -> None:
        """Raise TestFailure if the file cannot be read or has errors."""
        if not isinstance(system, System):
            system = load_system(Path(system), arguments or {}, settings or {})
        self._tested = system
        self._system = with_tester(system)
        self._seed = seed
        self._is_real = real_time
        self._start_ns = start_ns
        self._log_level = log_level
        self._record_to = record_to
        #: What became of the bag: its size and its folder, and what is missing in it.
        self.recorded: list[str] = []
        self._resources = ExitStack()
        self._observation = Observation(lambda: self._run.now_s)
        self._run: SystemRun
        self._faults: Faults
        self._tester: Tester

    def __enter__(self) -> Self:
        """Bring the system up.

        Raises StartRefused if it cannot run here, TestFailure, and BagError.
        """
        clock: Clock = COMPUTER if self._is_real else VirtualClock(start_ns=self._start_ns)
        tester = self._system.node(TESTER)
        ports = () if tester is None else tester.ports
        self._faults = Faults(clock, ports, self._on_tester)
        with ExitStack() as resources:
            recording = None if self._record_to is None else self._recording(self._record_to, clock)
            if recording is not None:
                resources.enter_context(recording.running())
            options = HostOptions(
                log_level=self._log_level,
                clock=clock,
                seed=self._seed,
                instruments=self._faults,
                recorder=recording,
            )
            self._run = SystemRun(self._system, options, self._observation.on_event)
            self._run.start(lambda: self._observation.is_up)
            if self.outcome is not None:
                raise self._failure("the system did not come up")
            self._resources = resources.pop_all()
        return self

    def _recording(self, folder: Path, clock: Clock) -> SystemRecording:
        return SystemRecording(self._system, Recording(), clock, self.recorded.append, folder)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Shut the system down. Raises TestFailure if it does not end."""
        with self._resources:
            self._run.end()

    # --- time

    @property
    def now_s(self) -> float:
        """The seconds since the start of the run."""
        return self._run.now_s

    def advance(self, seconds: float) -> None:
        """Let the system run for this time."""
        self._run.clock.sleep(seconds)

    def run_until(self, condition: Callable[[], object], timeout_s: float) -> None:
        """Let the system run until ``condition()``, which is checked after each of its steps.

        Raises TestFailure after ``timeout_s``, and what ``condition`` raises.
        """
        if not self._run.wait(condition, timeout_s):
            raise self._failure(unmet(condition, timeout_s))

    # --- what the system does

    @property
    def states(self) -> Mapping[str, str]:
        """The lifecycle states of the nodes, by their keys in the file."""
        nodes = self._run.host.nodes.items()
        return {name: node.state for name, node in nodes if name != TESTER}

    @property
    def log(self) -> Sequence[LogLine]:
        """The lines of the log so far."""
        return tuple(self._observation.log)

    @property
    def events(self) -> Sequence[Event]:
        """What was reported so far, except for lines of the log."""
        return tuple(self._observation.events)

    @property
    def history(self) -> Sequence[Received | Answer | LogLine | Event]:
        """Everything so far in one order: messages, answers to the test, log lines and events."""
        return self._observation.history

    @property
    def latencies(self) -> Mapping[str, ChainFigures]:
        """The latencies of the chains so far, by their names."""
        return {figures.chain: figures for figures in self._run.host.chains()}

    @property
    def outcome(self) -> Outcome | None:
        """How the run has ended; None while it lasts."""
        return self._run.outcome

    def messages(self, topic: str) -> Sequence[Received]:
        """Return the messages on a topic so far.

        Raises TestFailure for a topic that no node publishes.
        """
        self._port(PortKind.SUBSCRIPTION, topic)
        return tuple(self._observation.messages.get(topic, ()))

    def timeline(self, until_s: float = inf) -> list[str]:
        """Return the last events, messages and log lines until a time, each with its time."""
        return self._observation.timeline.lines(until_s)

    # --- what the test does

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message of the topic's type, or a mapping with values of its fields.

        Raises TestFailure for a topic without subscription, MessageError for wrong values.
        """
        publisher = self._tester.publishers[self._port(PortKind.PUBLISHER, topic)]
        converted = _converted(message, publisher.message_type, topic)
        self._observation.on_published(converted, topic)
        publisher.publish(converted)

    def play(self, messages: Iterable[tuple[float, str, Any]]) -> None:
        """Publish messages at their times (seconds since the start), until the last one.

        They are ``(time, topic, message)``, in order of their times. A timer publishes them, so
        that their order among calls of the system that are due at the same time is the same each
        time. Raises what :meth:`publish` and the iterable raise.
        """
        played = self._play_soon(messages)
        self.run_until(lambda: played.done() or self.outcome is not None, inf)
        if not played.done():
            raise self._failure("the system has ended before the last message")
        played.result()

    def _play_soon(self, messages: Iterable[tuple[float, str, Any]]) -> Future[None]:
        loop = self._run.host.nodes[TESTER].loop
        remaining = iter(messages)
        played: Future[None] = Future()

        def play_next(topic: str = "", message: Any = None) -> None:
            try:
                if topic:
                    self.publish(topic, message)
                following = next(remaining, None)
            except Exception as error:
                played.set_exception(error)
                return
            if following is None:
                played.set_result(None)
            else:
                time_s, *content = following
                loop.call_later(time_s - self.now_s, partial(play_next, *content))

        loop.call_soon(play_next)
        return played

    def replay(
        self,
        bag: Path,
        topics: Sequence[str] = (),
        start_s: float = 0.0,
        duration_s: float = inf,
    ) -> Future[None]:
        """Publish a part of a bag while the system runs; the future is done at its end.

        ``topics`` are full names, with ``*`` for any text; of these, all are published that the
        system receives and does not publish. Stamps in headers are shifted to the time of the
        system. Raises BagError; the future has the error if the bag is damaged.
        """
        self._observation.on_action(f"replay {bag}")

        def is_wanted(name: str) -> bool:
            return not topics or any(matches_wildcard(pattern, name) for pattern in topics)

        selection = Selection(is_wanted, start_s, duration_s)
        time_ns = self._run.clock.time_ns()
        messages = messages_of(open_bag(bag), selection, self._tested, self.now_s, time_ns)
        return self._play_soon(messages)

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
        self._observation.on_action(f"called {service} with {short(to_plain(converted))}")
        called: Future[Any] = client.call(converted, timeout_ms=timeout_s * 1000.0)
        called.add_done_callback(partial(self._observation.on_response, service))
        return called

    def send_goal(self, action: str, goal: Any = None) -> Goal:
        """Send a goal.

        Raises TestFailure for a name without server, MessageError for wrong values.
        """
        client = self._tester.action_clients[self._port(PortKind.ACTION_CLIENT, action)]
        converted = _converted(goal or {}, client.action_type.Goal, action)
        self._observation.on_action(f"sent {short(to_plain(converted))} to {action}")
        feedback: list[Any] = []
        sent = client.send_goal(converted, on_feedback=feedback.append)
        sent.add_done_callback(partial(self._observation.on_goal_answered, action))
        return Goal(self.wait_for, action, sent, feedback)

    def set_parameter(self, node: str, name: str, value: Any) -> None:
        """Set a parameter. Raises TestFailure if it is refused."""
        found = self._node(node)
        if not isinstance(found, InProcessNode):
            raise self._failure(f"{node} does not run in this process")
        self._observation.on_action(f"set {node}.{name} to {short(value)}")
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
        self._observation.on_action(f"requested '{transition}' of {node}")
        what = f"'{transition}' of {node}"
        outcome = self._run_on(found, found.lifecycle.change(transition), timeout_s, what)
        if not outcome.success:
            raise self._failure(f"{what} failed: {outcome.reason}")

    # --- faults

    def drop(self, topic: str, **limits: Unpack[Limits]) -> None:
        """Lose messages on a topic."""
        self._disturb(topic, "drop", faults.drop, limits)

    def delay(self, topic: str, delay_s: float, **limits: Unpack[Limits]) -> None:
        """Deliver messages on a topic late."""
        disturb = faults.delayed(delay_s, self._run.host.nodes[TESTER].loop.call_later)
        self._disturb(topic, f"delay by {delay_s:g} s", disturb, limits)

    def duplicate(self, topic: str, **limits: Unpack[Limits]) -> None:
        """Deliver messages on a topic twice."""
        self._disturb(topic, "duplicate", faults.duplicate, limits)

    def reorder(self, topic: str, **limits: Unpack[Limits]) -> None:
        """Swap each two messages on a topic."""
        self._disturb(topic, "reorder", faults.reordered(), limits)

    def corrupt(
        self, topic: str, change: Callable[[Any], object], **limits: Unpack[Limits]
    ) -> None:
        """Deliver what ``change`` makes of a copy of each message on a topic."""
        self._disturb(topic, "corrupt", faults.corrupted(change), limits)

    def delay_timer(self, node: str, timer: str, delay_s: float, **limits: Unpack[Limits]) -> None:
        """Let calls of a timer come late."""
        found = self._node(node)
        timers = [item.name.value for item in found.model.timers]
        if timer not in timers:
            raise unknown(f"{node} has no timer '{timer}'", timer, timers)
        disturb = faults.delayed(delay_s, found.loop.call_later)
        name = faults.timer_name(found.full_name, timer)
        self._add_fault(name, f"delay by {delay_s:g} s: timer {node}.{timer}", disturb, limits)

    @property
    def disturbable(self) -> Mapping[str, int]:
        """How many messages and calls faults could have acted on, by topic and ``node.timer``."""
        numbers = self._faults.seen
        found = {name: number for name, number in numbers.items() if "." not in name}  # topics
        for node in self._system.nodes:
            for timer in node.timers:
                name = faults.timer_name(node.full_name, timer.name.value)
                found[f"{node.name}.{timer.name}"] = numbers.get(name, 0)
        return found

    def end_faults(self, topic: str) -> None:
        """End the faults of a topic."""
        self._observation.on_action(f"end the faults of {topic}")
        self._faults.end(topic)

    def raise_in(self, node: str, handler: str | None = None, error: str = "injected") -> None:
        """Let the next call of a handler, such as "on_tick", raise RuntimeError; None for any."""

        def fail() -> None:
            raise RuntimeError(error)

        self._before_handler(node, handler, fail, "raise an exception")

    def hang(self, node: str, seconds: float, handler: str | None = None) -> None:
        """Let the next call of a handler block its executor for this time."""
        self._before_handler(node, handler, partial(self._run.clock.sleep, seconds), "hang")

    def kill(self, node: str, reason: str = "killed by the test") -> None:
        """Let a node fail, so that its ``on_failure`` applies."""
        found = self._node(node)
        if not isinstance(found, LocalNode):
            raise self._failure(f"{node} does not run in this process")
        self._observation.on_action(f"let {node} fail")
        found.loop.call_soon(partial(found.fail, reason))

    # --- waiting for what runs on a loop

    def wait_for(self, future: Future[T], timeout_s: float, what: str) -> T:
        """Let the system run until the future is done; return its result.

        Raises TestFailure after ``timeout_s``, and the exception of the future.
        """
        if not self._run.wait(future.done, timeout_s):
            future.cancel()
            raise self._failure(f"waited {timeout_s:g} s for {what}")
        return future.result()

    def _run_on(
        self, node: ManagedNode, coroutine: Coroutine[Any, Any, T], timeout_s: float, what: str
    ) -> T:
        return self.wait_for(node.loop.run_task(coroutine), timeout_s, what)

    def _on_tester(self, tester: Tester) -> None:
        self._tester = tester
        tester.on_message = self._observation.on_message

    # --- names

    def _node(self, name: str) -> ManagedNode:
        nodes = {key: node for key, node in self._run.host.nodes.items() if key != TESTER}
        by_name = {node.full_name: node for node in nodes.values()} | nodes
        if name not in by_name:
            raise unknown(f"the system has no node '{name}'", name, nodes)
        return by_name[name]

    def _port(self, kind: PortKind, full_name: str) -> str:
        return port_to(self._run.host.nodes[TESTER].model, kind, full_name)

    def _disturb(self, topic: str, what: str, disturb: faults.Disturb, limits: Limits) -> None:
        self._port(PortKind.PUBLISHER, topic)  # there is a subscription
        self._add_fault(topic, f"{what}: {topic}", disturb, limits)

    def _add_fault(self, name: str, text: str, disturb: faults.Disturb, limits: Limits) -> None:
        self._observation.on_action(text)
        until_s = self._run.clock.monotonic() + limits.get("for_s", inf)
        skip, count = limits.get("skip", 0), limits.get("count", inf)
        self._faults.add(name, Fault(disturb, skip, count, until_s))

    def _before_handler(
        self, node: str, handler: str | None, act: Callable[[], None], what: str
    ) -> None:
        model = self._node(node).model
        if model.behavior is None:
            raise self._failure(f"{node} has no behavior that could {what}")
        self._observation.on_action(f"let {node} {what}")
        self._faults.before_next_handler(model.name.value, handler, act)

    def _failure(self, text: str) -> TestFailure:
        if self.outcome is not None:
            text = f"{text}; the system has ended: {self.outcome.reason}"
        return TestFailure(text, self.timeline())


def _converted(content: Any, kind: Any, where: str) -> Any:
    if isinstance(content, Mapping):
        return convert_message(content, kind, where)
    if not isinstance(content, kind):
        raise MessageError(f"{where} takes a {kind.__name__}, not {type(content).__name__}")
    return content
