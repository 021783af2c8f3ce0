"""Drives one behavior in virtual time, from the thread of a test: without a system, without DDS.

::

    with BehaviorTest("nodes/planner.yaml", parameters={"max_velocity": 0.5}) as planner:
        planner.send("sensor_data", {"header": {"frame_id": "odom"}})
        response = planner.call("plan_trajectory", {"goal": {"x": 1.0}, "max_velocity": 1.0})
        assert response.success

The test is the other end of each port. Time passes only in ``advance``, ``run_until``, and while
the test waits for an answer. Exceptions of the behavior are raised in the test.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Self, TypeVar, cast

from composer.behavior import Logger
from composer.model import LogLevel, Port, PortKind
from composer.model.lifecycle import TRANSITIONS, available_transitions
from composer.model.transforms import Quaternion, Vector
from composer.runtime.clock import START_NS, VirtualClock
from composer.runtime.executors.futures import Future
from composer.runtime.executors.tasks import sleep
from composer.runtime.executors.tracebacks import describe
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate, PendingFutures
from composer.runtime.ports.goals import Handlers
from composer.testing.behavior_context import TestContext, VirtualLoop
from composer.testing.behavior_node import TestNode
from composer.testing.behavior_ports import ServicePort
from composer.testing.declarations import ParameterSet, load_node_type
from composer.testing.failures import (
    LogLine,
    Received,
    TestFailure,
    Timeline,
    short,
    unknown,
    unmet,
)
from composer.testing.goals import ActionServerPort, Goal, ServedGoal
from composer.testing.message_classes import MessageClasses

T = TypeVar("T")

#: What the ports of a behavior send.
_PARTS = {
    PortKind.PUBLISHER: "message",
    PortKind.CLIENT: "request",
    PortKind.ACTION_CLIENT: "goal",
}


class BehaviorTest:
    """One life of a node with a behavior. Use it as a context manager, once.

    ``node_type`` is the file of a node type, or its name in the project of the working directory;
    ``variables`` are values of its variables. The node is configured and activated at the start,
    unless ``start`` is false, and shut down at the end. Without ``raise_errors``, exceptions of the
    behavior are logged as in a running system.
    """

    __test__ = False  # no class of tests

    def __init__(
        self,
        node_type: Path | str,
        *,
        parameters: Mapping[str, Any] | None = None,
        variables: Mapping[str, Any] | None = None,
        start: bool = True,
        raise_errors: bool = True,
    ) -> None:
        """Raise TestFailure for a node type with errors or without a behavior, or wrong values."""
        self._model, interfaces = load_node_type(node_type, variables or {})
        self._messages = MessageClasses(interfaces)
        self._parameters = ParameterSet(self._model, parameters or {})
        self._starts = start
        self._raises = raise_errors
        self._clock = VirtualClock()
        self._loop = VirtualLoop(self._clock, self.exception)
        self._timeline = Timeline()
        self._sent: dict[str, list[Received]] = {}
        self._log: list[LogLine] = []
        self._context = TestContext(
            self._loop,
            self._loop,
            LifecycleGate(self._model.full_name, PendingFutures(self._loop)),
            log=cast(Logger, _Log(self._write_log)),
            error_log=self,
            record=self._record,
            note=self._note,
            names={"parameters": self._parameters.values},
            time_type=self._messages.interface("builtin_interfaces/msg/Time"),
        )
        self._node = TestNode(self._model, self._context, self._messages)

    def __enter__(self) -> Self:
        """Configure and activate the node. Raises what its handlers raise."""
        if self._starts:
            self.transition("configure")
            self.transition("activate")
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Deactivate, clean up and shut down, as the end of a system does."""
        try:
            for transition in ("deactivate", "cleanup", "shutdown"):
                if transition in available_transitions(self._node.state):
                    self.transition(transition)
        except BaseException:
            if kind is None:  # else the test has failed before
                raise

    # --- time

    @property
    def now_s(self) -> float:
        """The seconds since the start of the test."""
        return (self._clock.time_ns() - START_NS) / 1e9

    def advance(self, seconds: float) -> None:
        """Let time pass: timers fire, and sleeps and timeouts end. Raises what handlers raise."""
        self._loop.run_until(lambda: False, self._clock.monotonic() + seconds)

    def run_until(self, condition: Callable[[], object], timeout_s: float) -> None:
        """Let time pass until ``condition()``, which is checked after each step of the behavior.

        Raises TestFailure after ``timeout_s``, and what handlers and ``condition`` raise.
        """
        if not self._loop.run_until(condition, self._clock.monotonic() + timeout_s):
            raise self._failure(unmet(condition, timeout_s))

    def sleep(self, seconds: float) -> Future[None]:
        """Return what an ``async`` function of :meth:`answer` awaits to let time pass."""
        return sleep(self._loop, seconds)

    # --- what the behavior does

    @property
    def state(self) -> str:
        """The lifecycle state."""
        return self._node.state

    @property
    def log(self) -> Sequence[LogLine]:
        """The lines of the log so far."""
        return tuple(self._log)

    @property
    def behavior(self) -> Any:
        """The object of the behavior's class, for what no port shows; None before *configure*."""
        return self._node.behavior

    @property
    def failure(self) -> str | None:
        """The reason of the last ``self.fail(reason)``; the node stays as it is."""
        return self._node.failures[-1] if self._node.failures else None

    def messages(self, port: str) -> Sequence[Received]:
        """Return what a publisher has published; ``/tf`` and ``/tf_static`` are publishers too."""
        if self._node.transforms is None or not port.startswith("/tf"):
            self._port(port, PortKind.PUBLISHER)
        return tuple(self._sent.get(port, ()))

    def calls(self, port: str) -> Sequence[Received]:
        """Return the requests or goals that a client or action client has sent."""
        self._port(port, PortKind.CLIENT, PortKind.ACTION_CLIENT)
        return tuple(self._sent.get(port, ()))

    def timeline(self) -> list[str]:
        """Return the last messages, calls, transitions and lines of the log, each with its time."""
        return self._timeline.lines()

    # --- what the test does

    def send(self, port: str, message: Any = None) -> None:
        """Send a message to a subscription: its handler is called.

        Here and below, content is a message of the port's type, a mapping with values of its
        fields, or nothing for the defaults. Raises TestFailure for a name or value that does not
        exist, and what the handler raises.
        """
        declared = self._port(port, PortKind.SUBSCRIPTION)
        content = self._content(declared, "message", message)
        self._note(f"test: sent {short(content)} to '{port}'")
        self._running(port).put(content)
        self._settle()

    def call(self, port: str, request: Any = None, timeout_s: float = 5.0) -> Any:
        """Call a service of the node and return the response.

        Raises TestFailure without a response within ``timeout_s``, CallError if there is none, and
        what the handler raises.
        """
        content = self._content(self._port(port, PortKind.SERVICE), "request", request)
        self._note(f"test: called '{port}' with {short(content)}")
        return self._wait_for(self._running(port).call(content), timeout_s, f"'{port}' to respond")

    def send_goal(self, port: str, goal: Any = None) -> Goal:
        """Send a goal to an action server of the node."""
        content = self._content(self._port(port, PortKind.ACTION_SERVER), "goal", goal)
        self._note(f"test: sent the goal {short(content)} to '{port}'")
        feedback: list[Any] = []
        sent = self._loop.run_task(self._running(port).send(content, feedback.append))
        sent.add_done_callback(lambda done: done.exception())  # the goal may be rejected
        self._settle()
        return Goal(self._wait_for, f"'{port}'", sent, feedback)

    def answer(
        self,
        port: str,
        answer: Any = None,
        *,
        after_s: float = 0.0,
        accept: bool | Callable[[Any], bool] = True,
    ) -> None:
        """Answer the calls of a client, or the goals of an action client, from now on.

        ``answer`` is the response or the result, given ``after_s`` after the call; or a function,
        which may be ``async``: it gets the request or the goal, as a handler of an action server
        does. Goals are accepted if ``accept``, or ``accept(goal)``, is true. Without an answer,
        there is no server.
        """
        declared = self._port(port, PortKind.CLIENT, PortKind.ACTION_CLIENT)
        respond = partial(self._answer, declared, answer, after_s)
        gate = LifecycleGate(f"the server of '{port}'", PendingFutures(self._loop))
        gate.open()
        log = _Log(lambda _, text: self._note(f"the server of '{port}': {text}"))
        context = replace(self._context, gate=gate, log=cast(Logger, log))
        interface = self._messages.interface(declared.interface.value)
        served = replace(declared, reentrant=True)
        if declared.kind is PortKind.CLIENT:
            server: Any = ServicePort(context, served, interface, respond)
        else:
            accepts = accept if callable(accept) else lambda _: accept
            server = ActionServerPort(context, served, interface, Handlers(respond, accepts))
            server.make_feedback = partial(self._content, declared, "feedback")
        self._node.set_server(port, server)
        self._settle()

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a parameter. Raises TestFailure for a value that the node type does not allow."""
        self._note(f"test: set {name} to {short(value)}")
        changes = {name: self._parameters.set(name, value)}
        self._node.on_parameters(changes)
        self._settle()

    def set_transform(
        self,
        parent: str,
        child: str,
        translation: Vector = (0.0, 0.0, 0.0),
        rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0),
        *,
        at_s: float | None = None,
    ) -> None:
        """Let the behavior know a transform from ``child`` to ``parent``.

        It is valid at any time, or ``at_s`` seconds after the start of the test. ``rotation`` is a
        quaternion: x, y, z, w. Raises TestFailure for a node that looks up no transforms.
        """
        if self._node.transforms is None:
            raise self._failure("the node has no 'transforms', or is not configured")
        self._note(f"test: transform from '{child}' to '{parent}': {translation} {rotation}")
        stamp_ns = None if at_s is None else START_NS + round(at_s * 1e9)
        self._node.transforms.insert(parent, child, (translation, Quaternion(*rotation)), stamp_ns)
        self._settle()

    def transition(self, transition: str) -> None:
        """Run a transition, such as "deactivate".

        Raises TestFailure if it is not possible in the current state, and what its handler raises:
        TransitionFailed refuses it, after anything else the node is unconfigured.
        """
        if transition not in TRANSITIONS:
            raise unknown(f"there is no transition '{transition}'", transition, TRANSITIONS)
        available = available_transitions(self._node.state)
        if transition not in available:
            names = ", ".join(available) or "none"
            text = f"cannot {transition} the node: it is {self._node.state}"
            raise self._failure(f"{text}; available transitions: {names}")
        limit_s = 2 * self._model.supervision.timeout_ms / 1000.0
        changed = self._loop.run_task(self._node.change(transition))
        cause = self._wait_for(changed, limit_s, f"'{transition}'")
        self._settle()
        if cause is not None and self._raises:
            raise cause

    # --- what happens

    def _record(self, port: str, content: Any) -> None:
        declared = self._model.port(port)
        if declared is not None:
            self._messages.check(
                declared.interface.value, _PARTS[declared.kind], content, f"'{port}'"
            )
        self._sent.setdefault(port, []).append(Received(self.now_s, content))
        self._timeline.add(self.now_s, lambda: f"'{port}': {short(content)}")
        if self._node.transforms is not None and port.startswith("/tf"):
            self._node.transforms.on_broadcast(port, content)

    def _write_log(self, level: LogLevel, message: object) -> None:
        text = str(message)
        self._log.append(LogLine(self.now_s, level, self._model.full_name, text))
        self._note(f"[{level.upper()}] {text}")

    def exception(self, callback: str, error: BaseException) -> None:
        """Log an exception of a handler; the current method of the test raises it."""
        self._context.log.error(f"{callback}: {describe(error)}")
        if self._raises:
            self._loop.errors.append(error)

    def error(self, callback: str, text: str) -> None:
        """Log a wrong result of a handler; the current method of the test raises it."""
        self.exception(callback, TypeError(f"{callback} {text}"))

    def _note(self, text: str) -> None:
        self._timeline.add(self.now_s, lambda: text)

    # --- the other ends

    async def _answer(
        self, port: Port, answer: Any, after_s: float, asked: Any, _: object = None
    ) -> Any:
        """Answer a request, or execute a goal."""
        is_goal = isinstance(asked, ServedGoal)
        if after_s > 0.0:
            pause = self.sleep(after_s)
            if is_goal:
                asked.cancel_requested.add_done_callback(lambda _: pause.set_result(None))
            await pause
        result = answer(asked) if callable(answer) else answer
        if isinstance(result, Awaitable):
            result = await result
        return self._content(port, "result" if is_goal else "response", result)

    def _content(self, port: Port, part: str, content: Any) -> Any:
        return self._messages.make(port.interface.value, part, content, f"'{port.name}'")

    def _wait_for(self, future: Future[T], timeout_s: float, what: str) -> T:
        if not self._loop.run_until(future.done, self._clock.monotonic() + timeout_s):
            future.cancel()
            raise self._failure(f"waited {timeout_s:g} s for {what}")
        self._loop.raise_error()
        return future.result()

    def _settle(self) -> None:
        """Make the calls that are due now."""
        self._loop.raise_error()
        self.advance(0.0)

    def _port(self, name: str, *kinds: PortKind) -> Port:
        names = [port.name.value for port in self._model.ports_of(*kinds)]
        port = self._model.port(name)
        if port is None or name not in names:
            what = " or ".join(kinds)
            raise unknown(f"the node type has no {what} '{name}'", name, names)
        return port

    def _running(self, name: str) -> Any:
        if name not in self._node.ports:
            raise self._failure(
                f"the node is {self._node.state}: it has ports from 'configure' to 'cleanup'"
            )
        return self._node.ports[name]

    def _failure(self, text: str) -> TestFailure:
        return TestFailure(text, self.timeline())


class _Log:
    """``log`` of a behavior; see :class:`composer.behavior.Logger`."""

    def __init__(self, write: Callable[[LogLevel, object], None]) -> None:
        for level in LogLevel:
            setattr(self, level.value, partial(write, level))
