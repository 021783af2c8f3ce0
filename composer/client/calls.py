"""Service calls and action goals, to any server."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.client import ActionClient, ClientGoalHandle
from rclpy.task import Future

from composer.base.fast_dataclass import dataclass
from composer.client.graph_names import type_mismatch_hint
from composer.client.messages.values import build_message, class_of
from composer.client.requests import ServiceCaller, wait_until_known
from composer.client.session import Deadline, NoResponseError, RosError, Session

_STATUS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}
_CANCEL_WITHIN_S = 5.0
#: How long to wait for a result that a server sent before it went away.
_LAST_RESULT_S = 0.5

#: Says whether to stop waiting.
ShouldStop = Callable[[], bool]


class GoalRejectedError(RosError):
    """The action server rejected the goal."""


@dataclass(frozen=True, slots=True)
class FinishedGoal:
    """The end of a goal: ``succeeded``, ``canceled`` or ``aborted``, and the result message."""

    status: str
    result: Any


@dataclass(frozen=True, slots=True)
class ServiceRequest:
    """A request, as YAML or plain values, for a service.

    With ``rate_hz`` it is sent again and again.
    """

    name: str
    type_name: str
    request: str | Mapping[str, Any]
    rate_hz: float | None = None


def call_service(session: Session, deadline: Deadline, request: ServiceRequest) -> Iterator[Any]:
    """Yield the response to a request, or the responses to repeated ones.

    The deadline is for the first response; each later one has as much time. Raises
    InvalidValueError, NoResponseError.
    """
    service = class_of(request.type_name, "service")
    message = build_message(request.request, service.Request, "the request")
    with closing(ServiceCaller(session)) as caller:
        next_s = time.monotonic()
        while True:
            yield caller.call_once(service, request.name, message, deadline)
            if request.rate_hz is None:
                return
            next_s = max(next_s + 1.0 / request.rate_hz, time.monotonic())
            session.spin_until(next_s)
            deadline = Deadline(deadline.timeout_s)


class GoalClient(ActionClient):
    """Takes all feedback before the result: rclpy drops the feedback that is left after it.

    If another thread destroys it, the executor gets InvalidHandle, as for other entities.
    """

    def add_to_wait_set(self, wait_set: Any) -> None:
        """Add its entities. Raises InvalidHandle if it is destroyed; rclpy goes on, and fails."""
        with self:
            super().add_to_wait_set(wait_set)

    def take_data(self) -> Any:
        """Take the data that is ready; leave the result while there is feedback."""
        self._is_result_response_ready = (
            self._is_result_response_ready and not self._is_feedback_ready
        )
        return super().take_data()


class AcceptedGoal:
    """A goal that an action server has accepted."""

    def __init__(
        self, session: Session, client: ActionClient, name: str, handle: ClientGoalHandle
    ) -> None:
        self._session = session
        self._client = client
        self._name = name
        self._handle = handle
        self._result: Future = handle.get_result_async()

    def result(self, should_stop: ShouldStop) -> FinishedGoal | None:
        """Wait for the end of the goal; None if ``should_stop`` is true first.

        Raises NoResponseError if the server goes away.
        """
        while not self._result.done() and not should_stop():
            self._session.spin_once(Deadline(1.0))
            if not self._client.server_is_ready():
                self._wait_for_last_result()
        return self._finished() if self._result.done() else None

    def cancel(self) -> FinishedGoal:
        """Cancel the goal and wait for its end. Raises NoResponseError if it does not end."""
        limit = Deadline(_CANCEL_WITHIN_S)
        self._handle.cancel_goal_async()
        if not self._session.wait_for(self._result.done, limit):
            raise NoResponseError(f"the goal was not canceled within {_CANCEL_WITHIN_S:g} s")
        return self._finished()

    def _wait_for_last_result(self) -> None:
        """Wait for a result that was sent before the server went away. Raises NoResponseError."""
        limit = Deadline(_LAST_RESULT_S)
        if not self._session.wait_for(self._result.done, limit):
            raise NoResponseError(f"the server of '{self._name}' is gone, so the goal is lost")

    def _finished(self) -> FinishedGoal:
        response = self._result.result()
        return FinishedGoal(_STATUS.get(response.status, "unknown"), response.result)


@dataclass(frozen=True, slots=True)
class GoalRequest:
    """A goal, as YAML or plain values, for an action, with the handler of its feedback."""

    name: str
    type_name: str
    goal: str | Mapping[str, Any]
    on_feedback: Callable[[Any], None]
    should_stop: ShouldStop


@contextmanager
def send_goal(session: Session, deadline: Deadline, request: GoalRequest) -> Iterator[AcceptedGoal]:
    """Send a goal; the ``with`` block begins once it is accepted.

    Raises InvalidValueError, NoResponseError, GoalRejectedError. Raises KeyboardInterrupt if
    ``should_stop`` is true before the goal is sent; afterwards the response is awaited, so that the
    goal can be canceled.
    """
    name = request.name
    action = class_of(request.type_name, "action")
    message = build_message(request.goal, action.Goal, "the goal")
    client = GoalClient(session.node, action, name)
    try:
        is_ready = session.wait_for(
            lambda: client.server_is_ready() or request.should_stop(), deadline
        )
        if client.server_is_ready():
            wait_until_known(session, f"{name}/_action/send_goal", deadline)
        if request.should_stop():
            raise KeyboardInterrupt
        if not is_ready:
            hint = type_mismatch_hint(session, "action", name, request.type_name)
            raise NoResponseError(
                f"no server of '{name}' found within {deadline.timeout_s:g} s", hint
            )
        response: Future = client.send_goal_async(
            message, lambda item: request.on_feedback(item.feedback)
        )
        if not session.wait_for(response.done, deadline):
            raise NoResponseError(f"no goal response from '{name}' within {deadline.timeout_s:g} s")
        if not response.result().accepted:
            raise GoalRejectedError(f"'{name}' rejected the goal")
        yield AcceptedGoal(session, client, name, response.result())
    finally:
        client.destroy()
