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

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, Unpack

from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from composer.bags.editing import Selection
from composer.bags.reader import open_bag
from composer.model import ParameterType, PortKind
from composer.model.names import matches_wildcard
from composer.runtime.executors.futures import Future
from composer.runtime.hosting.user_code import current_instance
from composer.runtime.node.local_node import LocalNode
from composer.runtime.ros.messages import MessageError, convert_message, to_plain
from composer.testing import faults
from composer.testing.bag_messages import messages_of
from composer.testing.failures import short, unknown
from composer.testing.faults import Fault, Limits
from composer.testing.goals import Goal
from composer.testing.tested_system import TestedSystem
from composer.testing.tester import TESTER

_PARAMETER_WITHIN_S = 5.0


class SystemTest(TestedSystem):
    """One run of a system. Use it as a context manager, once.

    ``system`` is a file, or a model that is already loaded. ``arguments`` are for the system,
    ``settings`` values of parameters by ``node.parameter``. With ``real_time``, the system has the
    time of the computer. Runs with the same ``seed`` have the same random numbers. Virtual time
    begins at ``start_ns`` (nanoseconds since 1970). ``record_to`` is the folder of a new bag, for
    what all nodes and the test publish.
    """

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
        if not isinstance(found, LocalNode):
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
        """Let the next call of a handler, such as "on_tick", raise RuntimeError; None for any.

        The handlers of a class are its callbacks, by the names of their functions. Raises
        TestFailure for a node without code in this process, or without such a handler.
        """

        def fail() -> None:
            raise RuntimeError(error)

        self._before_handler(node, handler, fail, "raise an exception")

    def hang(self, node: str, seconds: float, handler: str | None = None) -> None:
        """Let the next call of a handler block for this time, as :meth:`raise_in`.

        A behavior blocks its executor, a class its callback group.
        """
        self._before_handler(node, handler, partial(self._block, seconds), "hang")

    def _block(self, seconds: float) -> None:
        instance = current_instance()
        if instance is None:
            self._run.clock.sleep(seconds)
        else:  # as time.sleep() in a class: what is not in its group goes on
            instance.wait(threading.Event(), seconds)

    def kill(self, node: str, reason: str = "killed by the test") -> None:
        """Let a node fail, so that its ``on_failure`` applies."""
        found = self._node(node)
        if not isinstance(found, LocalNode):
            raise self._failure(f"{node} does not run in this process")
        self._observation.on_action(f"let {node} fail")
        found.loop.call_soon(partial(found.fail, reason))

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
        found = self._node(node)
        model = found.model
        if model.behavior is None and model.hosted_class is None:
            raise self._failure(f"{node} has no behavior and no class that could {what}")
        handlers = self._faults.handlers(model.full_name)
        # A method of a class may become a callback later.
        instance = getattr(found, "instance", None)
        if handler and handlers and handler not in handlers and not hasattr(instance, handler):
            raise unknown(f"{node} has no handler '{handler}'", handler, handlers)
        self._observation.on_action(f"let {node} {what}")
        self._faults.before_next_handler(model.full_name, handler, act)


def _converted(content: Any, kind: Any, where: str) -> Any:
    if isinstance(content, Mapping):
        return convert_message(content, kind, where)
    if not isinstance(content, kind):
        raise MessageError(f"{where} takes a {kind.__name__}, not {type(content).__name__}")
    return content
