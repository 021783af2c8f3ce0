"""Goals in a test: those that it sends, and the action servers of a behavior and of its test."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import Any, TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.behavior import CallCancelled, GoalRejected
from composer.runtime.executors.exceptions import describe, is_closing, shown
from composer.runtime.executors.futures import Cancelled, Future, wrap_future
from composer.runtime.executors.tasks import within
from composer.runtime.ports import RunningPort
from composer.testing.behavior_context import TestContext

#: How long handlers may take to end their goals once the node leaves *active*, as in the runtime.
_CANCEL_LIMIT_S = 1.0
#: Waits for a future, at most for a time; the text says for what.
WaitFor: TypeAlias = Callable[[Future[Any], float, str], Any]


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a goal ended; see :class:`composer.behavior.GoalResult`."""

    status: str
    result: Any


class ServedGoal:
    """A goal of an action server, and its client's view of it.

    See :class:`composer.behavior.Goal` and :class:`composer.behavior.SentGoal`.
    """

    def __init__(self, server: ActionServerPort, request: Any, on_feedback: Any) -> None:
        self._server = server
        self._on_feedback = on_feedback
        self.request = request
        self.is_cancel_requested = False
        #: As in action_msgs/msg/GoalStatus.
        self.status = "accepted"
        self.task: Future[Any] | None = None
        self.cancel_requested: Future[None] = Future()
        self.outcome: Future[Outcome] = Future()

    @property
    def is_open(self) -> bool:
        """Whether the goal has not ended."""
        return self.status in ("accepted", "executing", "canceling")

    def request_cancel(self) -> None:
        """Notify the handler."""
        self.is_cancel_requested = True
        self.cancel_requested.set_result(None)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the client. Raises TypeError for another type than the Feedback."""
        feedback = self._server.make_feedback(feedback)
        if self.is_open:
            self._on_feedback(feedback)

    def succeed(self) -> None:
        """End the goal as succeeded."""
        self.end("succeeded")

    def abort(self) -> None:
        """End the goal as aborted."""
        self.end("aborted")

    def canceled(self) -> None:
        """End the goal as canceled."""
        self.end("canceled")

    def end(self, status: str) -> None:
        """End the goal. Raises RuntimeError if it has ended."""
        if not self.is_open:
            raise RuntimeError(f"the goal is {self.status}, so it cannot become {status}")
        self.status = status

    # --- the client's view

    def result(self) -> Future[Outcome]:
        """Return a future of the outcome, which may be canceled."""
        return wrap_future(self.outcome, cancels=False)

    def cancel(self) -> Future[bool]:
        """Request cancellation; true if the goal has not ended."""
        answer: Future[bool] = Future()
        answer.set_result(self.is_open)
        self._server.cancel(self)
        return answer


class ActionServerPort(RunningPort):
    """Executes goals, as the runtime does; for a behavior, or for a client of the behavior."""

    def __init__(
        self,
        context: TestContext,
        name: str,
        action_type: Any,
        handlers: tuple[Callable[[ServedGoal], Any], Callable[[Any], Any] | None],
        limit: float | None,
    ) -> None:
        """``handlers`` execute and accept goals; ``limit`` may wait, None: none waits."""
        self._context = context
        self._name = name
        self.action_type = action_type
        self._execute, self._accept = handlers
        self._limit = limit
        self._queue = context.queue(self._run, reentrant=limit is None)
        self._goals: dict[ServedGoal, None] = {}

    def make_feedback(self, feedback: Any) -> Any:
        """Return what a handler publishes. Raises TypeError for another type."""
        if not isinstance(feedback, self.action_type.Feedback):
            raise TypeError(f"Expected {self.action_type.Feedback}, got {type(feedback)}")
        return feedback

    async def send(self, request: Any, on_feedback: Callable[[Any], object]) -> ServedGoal:
        """Return the goal if it is accepted. Raises GoalRejected."""
        try:
            reason = await self._rejection(request)
        except BaseException as error:
            self._context.on_exception(f"accept_{self._name}", error)
            reason = describe(error)
        if reason is not None:
            self._context.log.info(f"action server '{self._name}' rejects a goal: {reason}")
            raise GoalRejected(f"action '{self._name}' rejected the goal")
        goal = ServedGoal(self, request, on_feedback)
        self._goals[goal] = None
        self._queue.put(goal)
        return goal

    async def _rejection(self, request: Any) -> str | None:
        gate = self._context.gate
        if not gate.incoming:
            return gate.refusal
        if self._limit is not None and len(self._goals) > self._limit:
            return f"{self._limit} goals are waiting already"
        if self._accept is not None:
            accepted = self._accept(request)
            if isinstance(accepted, Awaitable):
                accepted = await accepted
            if accepted is not True:
                return f"accept_{self._name} returned {shown(accepted)}"
        return None if gate.incoming else gate.refusal

    def cancel(self, goal: ServedGoal) -> None:
        """Request cancellation; a goal that waits ends at once."""
        if goal.task is None:
            self._context.loop.call_soon(lambda: self._end(goal, None, "canceled"))
        elif goal.is_open:
            goal.status = "canceling"
            goal.request_cancel()

    def deactivate(self) -> None:
        """Cancel the waiting goals and request cancellation of the running ones."""
        for goal in self._queue.clear():
            self._end(goal, None, "canceled")
        for goal in self._goals:
            goal.request_cancel()

    async def drain(self) -> None:
        """Wait until the handlers have ended their goals; after a time limit, cancel them."""
        for goal in tuple(self._goals):
            try:
                await within(self._context.loop, goal.result(), _CANCEL_LIMIT_S)
            except TimeoutError:
                text = f"a goal did not end within {_CANCEL_LIMIT_S:g} s, canceled"
                self._context.log.warn(f"action server '{self._name}': {text}")
                self._end(goal, None, "canceled")
                if goal.task is not None:
                    goal.task.cancel()

    async def _run(self, goal: ServedGoal) -> None:
        if not goal.is_open:
            return
        goal.status = "executing"
        goal.task = self._context.spawn(self._handled(goal))
        try:
            result = await goal.task
        except (Cancelled, CallCancelled):
            self._end(goal, None, "canceled")
        except BaseException as error:
            if is_closing(error):
                raise
            self._end(goal, None, "aborted")
            self._context.error_log.exception(f"on_{self._name}", error)
        else:
            self._end(goal, result, "canceled" if goal.is_cancel_requested else "succeeded")

    async def _handled(self, goal: ServedGoal) -> Any:
        result = self._execute(goal)
        if isinstance(result, Awaitable):
            result = await result
        if result is not None and not isinstance(result, self.action_type.Result):
            kind = f"{self.action_type.__name__}.Result"
            raise TypeError(f"on_{self._name} returned {shown(result)}, not a {kind}")
        return result

    def _end(self, goal: ServedGoal, result: Any, status: str) -> None:
        if goal not in self._goals:
            return
        del self._goals[goal]
        if goal.is_open:
            goal.status = status
        result = self.action_type.Result() if result is None else result
        goal.outcome.set_result(Outcome(goal.status, result))


class Goal:
    """A goal that a test has sent."""

    def __init__(
        self, wait_for: WaitFor, action: str, sent: Future[Any], feedback: Sequence[Any]
    ) -> None:
        self._wait_for = wait_for
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
            sent = self._wait_for(self._sent, timeout_s, f"an answer of {self._action}")
            self._outcome = sent.result()
        return self._wait_for(self._outcome, timeout_s, f"the result of {self._action}")

    def cancel(self, timeout_s: float = 5.0) -> bool:
        """Request to cancel the goal; return whether the server accepts that."""
        sent = self._wait_for(self._sent, timeout_s, f"an answer of {self._action}")
        what = f"{self._action} to cancel the goal"
        return bool(self._wait_for(sent.cancel(), timeout_s, what))
