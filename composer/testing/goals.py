"""Goals in a test: those that it sends, and the action servers of a behavior and of its test."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from composer.behavior import GoalRejected
from composer.runtime.executors.futures import Future, wrap_future
from composer.runtime.executors.tasks import sleep
from composer.runtime.ports.goals import GoalExecutor, GoalOutcome

#: Waits for a future, at most for a time; the text says for what.
WaitFor: TypeAlias = Callable[[Future[Any], float, str], Any]


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
        self.has_begun = False
        self.task: Future[Any] | None = None
        self.cancel_requested: Future[None] = Future()
        self.ended: Future[None] = Future()
        self.outcome: Future[GoalOutcome] = Future()

    @property
    def is_open(self) -> bool:
        """Whether the goal has not ended."""
        return self.status in ("accepted", "executing", "canceling")

    def execute(self) -> None:
        """Set the status to executing."""
        self.status = "executing"

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

    def result(self) -> Future[GoalOutcome]:
        """Return a future of the outcome, which may be canceled."""
        return wrap_future(self.outcome, cancels=False)

    def cancel(self) -> Future[bool]:
        """Request cancellation; true if the goal has not ended."""
        answer: Future[bool] = Future()
        answer.set_result(self.is_open)
        self._server.cancel(self)
        return answer


class ActionServerPort(GoalExecutor[ServedGoal]):
    """Executes goals, as the runtime does; for a behavior, or for a client of the behavior."""

    def make_feedback(self, feedback: Any) -> Any:
        """Return what a handler publishes. Raises TypeError for another type."""
        if not isinstance(feedback, self._type.Feedback):
            raise TypeError(f"Expected {self._type.Feedback}, got {type(feedback)}")
        return feedback

    async def send(self, request: Any, on_feedback: Callable[[Any], object]) -> ServedGoal:
        """Return the goal if it is accepted. Raises GoalRejected."""
        if not await self._is_accepted(request):
            raise GoalRejected(f"action '{self._name}' rejected the goal")
        goal = ServedGoal(self, request, on_feedback)
        self._start(goal)
        return goal

    def cancel(self, goal: ServedGoal) -> None:
        """Request cancellation; a goal that waits ends at once."""
        if not goal.has_begun:
            self._context.loop.call_soon(lambda: self._end(goal, None, canceled=True))
        elif goal.is_open:
            goal.status = "canceling"
            goal.request_cancel()

    async def _steps(self, goal: ServedGoal) -> Any:
        await sleep(self._context.loop, 0.0)  # its client learns first that it is accepted
        return await super()._steps(goal)

    def _send_result(self, goal: ServedGoal, result: Any) -> None:
        goal.outcome.set_result(GoalOutcome(goal.status, result))


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
