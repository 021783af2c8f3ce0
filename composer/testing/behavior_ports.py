"""The topics and services of a behavior in a test: the other end of each is the test."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from functools import partial
from math import inf
from typing import Any, TypeVar

from composer.behavior import CallCancelled, CallTimeout, ServerUnavailable
from composer.model import Port
from composer.model.qos import Durability
from composer.runtime.executors.futures import Future, wrap_future
from composer.runtime.ports import RunningPort
from composer.runtime.ports.goals import GoalOutcome
from composer.runtime.ports.serving import RequestServer
from composer.testing.behavior_context import TestContext
from composer.testing.goals import ActionServerPort, ServedGoal

T = TypeVar("T")


class PublisherPort(RunningPort):
    """Records the messages of a publisher; see :class:`composer.behavior.Publisher`."""

    def __init__(self, context: TestContext, name: str, message_type: Any) -> None:
        self._context = context
        self._name = name
        self.message_type = message_type

    @property
    def gated(self) -> PublisherPort:
        """What the behavior publishes with."""
        return self

    def publish(self, message: Any) -> None:
        """Record ``message``; not while the node is inactive. Raises TypeError for other types."""
        if not isinstance(message, self.message_type):
            raise TypeError(f"Expected {self.message_type}, got {type(message)}")
        if self._context.gate.outgoing:
            self._context.record(self._name, message)
        else:
            reason = self._context.gate.refusal
            self._context.log.warn(f"publisher '{self._name}' drops its messages: {reason}")


class SubscriptionPort(RunningPort):
    """Passes the messages of the test to their handler while the node is active."""

    def __init__(
        self, context: TestContext, port: Port, handle: Callable[[Any], Coroutine[Any, Any, None]]
    ) -> None:
        self._context = context
        depth = port.qos.profile.queue_depth
        self._queue = context.queue(handle, depth=depth, reentrant=port.reentrant)
        is_latched = port.qos.profile.durability is Durability.TRANSIENT_LOCAL
        self._latched = deque[Any](maxlen=depth if is_latched else 0)

    def put(self, message: Any) -> None:
        """Handle a message, now or after the previous ones."""
        if not self._context.gate.incoming:
            self._latched.append(message)
        elif self._queue.put(message) is not None:
            self._context.note("the queue is full: the oldest message was dropped")

    def activate(self) -> None:
        """Handle the messages that were latched meanwhile."""
        while self._latched:
            self._queue.put(self._latched.popleft())

    def deactivate(self) -> None:
        """Drop the messages that wait."""
        self._queue.clear()


class ServicePort(RequestServer):
    """Answers requests by a handler: of a behavior, or of the test for a client of the behavior."""

    def call(self, request: Any) -> Future[Any]:
        """Return the future of the response. It fails as a call in the process does."""
        answer: Future[Any] = Future()
        self.on_request(request, _Reply(answer))
        return answer


class _Reply:
    """Ends one request of the test or of the behavior."""

    def __init__(self, answer: Future[Any]) -> None:
        self._answer = answer

    def __call__(self, response: Any) -> None:
        self._answer.set_result(response)

    def refuse(self, error: BaseException) -> None:
        """Send no response."""
        self._answer.set_exception(error)


class ClientPort(RunningPort):
    """A client or action client of the behavior; the test is its server.

    See :class:`composer.behavior.Client` and :class:`composer.behavior.ActionClient`.
    """

    def __init__(self, context: TestContext, port: Port, interface: Any) -> None:
        self._context = context
        self._name = port.name.value
        self._what = f"{port.kind.channel} '{port.full_name}'"
        self._label = f"{port.kind} '{self._name}'"
        self._timeout_ms = port.call_timeout_ms
        self._result_timeout_ms = inf if (most := port.result_timeout_ms) is None else most.value
        self.service_type = self.action_type = interface
        self._server: Future[Any] = Future()
        self._feedback = context.queue(self._handle_feedback, reentrant=port.reentrant)
        self._goals: dict[ServedGoal, None] = {}

    def set_server(self, server: ServicePort | ActionServerPort) -> None:
        """Send requests and goals to ``server`` from now on."""
        if self._server.done():
            self._server = Future()
        self._server.set_result(server)

    def call(self, request: Any, *, timeout_ms: float | None = None) -> Future[Any]:
        """Call the service. The future fails as in the runtime. Raises TypeError."""
        self._check_type(request, self.service_type.Request)
        if self._server.done():
            self._context.record(self._name, request)
            server: ServicePort = self._server.result()
            return self.limited(server.call(request), self._limit_ms(timeout_ms))
        called = self._context.spawn(self._send(request, timeout_ms, lambda s: s.call(request)))
        return wrap_future(called, self._report)

    def send_goal(
        self,
        goal: Any,
        *,
        on_feedback: Callable[[Any], object] | None = None,
        timeout_ms: float | None = None,
    ) -> Future[ClientGoal]:
        """Send a goal. The future fails as in the runtime. Raises TypeError."""
        self._check_type(goal, self.action_type.Goal)
        return self._context.spawn(self._send_goal(goal, on_feedback, timeout_ms))

    def deactivate(self) -> None:
        """Cancel the running goals; the gate ends the pending calls."""
        self._feedback.clear()
        for goal in self._goals:
            goal.cancel()

    def limited(
        self,
        future: Future[T],
        timeout_ms: float,
        until_s: float | None = None,
        late: Callable[[str], BaseException] = CallTimeout,
        what: str = "{} did not answer",
    ) -> Future[T]:
        """Return the future, which fails at its limit and when the node leaves *active*."""
        gate = self._context.gate
        if until_s is None:
            until_s = self._context.loop.clock.monotonic() + timeout_ms / 1000.0
        if not gate.outgoing:
            future.set_exception(CallCancelled(gate.refusal))
        text = f"{what.format(self._what)} within {timeout_ms:g} ms"
        return gate.pending.add(future, until_s, lambda: late(text))

    async def result(self, goal: ServedGoal, timeout_ms: float | None) -> GoalOutcome:
        """Wait until a goal has ended."""
        limit_ms = self._result_timeout_ms if timeout_ms is None else timeout_ms
        return await self.limited(goal.result(), limit_ms)

    def _limit_ms(self, timeout_ms: float | None) -> float:
        return self._timeout_ms if timeout_ms is None else timeout_ms

    async def _send(
        self, content: Any, timeout_ms: float | None, send: Callable[[Any], Future[Any]]
    ) -> Any:
        timeout_ms = self._limit_ms(timeout_ms)
        until_s = self._context.loop.clock.monotonic() + timeout_ms / 1000.0
        missing = "no server of {} was available"
        server = wrap_future(self._server, cancels=False)
        server = await self.limited(server, timeout_ms, until_s, ServerUnavailable, missing)
        self._context.record(self._name, content)
        return await self.limited(send(server), timeout_ms, until_s)

    async def _send_goal(
        self, request: Any, on_feedback: Callable[[Any], object] | None, timeout_ms: float | None
    ) -> ClientGoal:
        receive = partial(self._on_feedback, on_feedback)
        run_task = self._context.loop.run_task
        goal: ServedGoal = await self._send(
            request, timeout_ms, lambda server: run_task(server.send(request, receive))
        )
        self._goals[goal] = None
        goal.outcome.add_done_callback(lambda _: self._goals.pop(goal, None))
        return ClientGoal(self._context, self, goal)

    def _check_type(self, content: Any, kind: Any) -> None:
        if not isinstance(content, kind):
            expected = f"{self.service_type.__name__}.{kind.__name__.rpartition('_')[2]}"
            raise TypeError(f"{self._label} takes a {expected}, not {type(content).__name__}")

    def _report(self, error: BaseException) -> None:
        """Record a failed call for which nothing waits."""
        if not isinstance(error, CallCancelled):
            self._context.error_log.exception(self._label, error)

    def _on_feedback(self, on_feedback: Callable[[Any], object] | None, feedback: Any) -> None:
        if on_feedback is not None and self._context.gate.incoming:
            self._context.loop.call_soon(lambda: self._feedback.put((on_feedback, feedback)))

    def _handle_feedback(self, item: tuple[Any, Any]) -> Coroutine[Any, Any, None] | None:
        on_feedback, feedback = item
        return self._context.call(f"feedback of '{self._name}'", on_feedback, feedback)


class ClientGoal:
    """A goal that the server accepted; see :class:`composer.behavior.SentGoal`."""

    def __init__(self, context: TestContext, port: ClientPort, goal: ServedGoal) -> None:
        self._context = context
        self._port = port
        self._goal = goal

    def result(self, *, timeout_ms: float | None = None) -> Future[GoalOutcome]:
        """Wait until the goal has ended. Fails with CallTimeout or CallCancelled."""
        return self._context.spawn(self._port.result(self._goal, timeout_ms))

    def cancel(self) -> Future[bool]:
        """Request cancellation; true if accepted."""
        return self._goal.cancel()
