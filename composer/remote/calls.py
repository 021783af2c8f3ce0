"""Service calls and action goals from the command line, to any server."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.client import ActionClient, ClientGoalHandle
from rclpy.task import Future

from composer.remote.graph_names import other_types
from composer.remote.requests import call_once
from composer.remote.session import Deadline, NoAnswer, RosError, Session
from composer.remote.values import class_of, compile_content

_STATUS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}
_CANCEL_PATIENCE_S = 2.0
_LAST_WORDS_S = 0.5

#: Says whether somebody wants the end.
Stop = Callable[[], bool]


class Rejected(RosError):
    """The action server did not take the goal."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a goal ended: ``succeeded``, ``canceled`` or ``aborted``, and the result message."""

    status: str
    result: Any


def call_service(
    session: Session, deadline: Deadline, name: str, type_name: str, request: str
) -> Any:
    """Return the response to ``request``, which is YAML. Raises BadValue, NoAnswer."""
    service = class_of(type_name, "service")
    message = compile_content(request, service.Request, "the request")({})
    try:
        return call_once(session, service, name, message, deadline)
    except NoAnswer as error:
        raise NoAnswer(str(error), other_types(session, "service", name, type_name)) from error


class _Client(ActionClient):
    """Takes all feedback that is there before a result: with that rclpy drops what is left."""

    def take_data(self) -> Any:
        """Take what has come; the result stays where it is while feedback comes."""
        self._is_result_response_ready = (
            self._is_result_response_ready and not self._is_feedback_ready
        )
        return super().take_data()


class Goal:
    """A goal that an action server has taken."""

    def __init__(
        self, session: Session, client: ActionClient, name: str, handle: ClientGoalHandle
    ) -> None:
        self._session = session
        self._client = client
        self._name = name
        self._handle = handle
        self._result: Future = handle.get_result_async()

    def result(self, stop: Stop) -> Outcome | None:
        """Wait for the end of the goal; None when ``stop`` comes first.

        Raises NoAnswer when the server goes away.
        """
        while not self._result.done() and not stop():
            self._session.spin_once(Deadline(1.0))
            if not self._client.server_is_ready():
                self._take_last_words()
        return self._outcome() if self._result.done() else None

    def cancel(self) -> Outcome:
        """Ask for the end of the goal and wait for it. Raises NoAnswer when it does not end."""
        patience = Deadline(_CANCEL_PATIENCE_S)
        self._handle.cancel_goal_async()
        if self._session.wait_for(lambda: self._result.done() or None, patience) is None:
            raise NoAnswer("the goal was to be canceled and goes on")
        return self._outcome()

    def _take_last_words(self) -> None:
        """Take a result that a server sent before it went away. Raises NoAnswer."""
        patience = Deadline(_LAST_WORDS_S)
        if self._session.wait_for(lambda: self._result.done() or None, patience) is None:
            raise NoAnswer(f"the server of '{self._name}' is gone, and the goal with it")

    def _outcome(self) -> Outcome:
        response = self._result.result()
        return Outcome(_STATUS.get(response.status, "unknown"), response.result)


@dataclass(frozen=True, slots=True)
class Sending:
    """A goal, which is YAML, for the action ``name`` of a type, and who follows it."""

    name: str
    type_name: str
    goal: str
    on_feedback: Callable[[Any], None]
    stop: Stop


@contextmanager
def sent_goal(session: Session, deadline: Deadline, sending: Sending) -> Iterator[Goal]:
    """Send a goal; the block begins once it is taken.

    Raises BadValue, NoAnswer, Rejected, and KeyboardInterrupt when ``stop`` comes before the goal
    is sent; a goal that is sent is waited for, so that it can be canceled.
    """
    name = sending.name
    action = class_of(sending.type_name, "action")
    message = compile_content(sending.goal, action.Goal, "the goal")({})
    client = _Client(session.node, action, name)
    try:
        ready = session.wait_for(
            lambda: client.server_is_ready() or sending.stop() or None, deadline
        )
        if sending.stop():
            raise KeyboardInterrupt
        if not ready:
            hint = other_types(session, "action", name, sending.type_name)
            raise NoAnswer(f"no server of '{name}' was there within {deadline.timeout_s:g} s", hint)
        answer: Future = client.send_goal_async(
            message, lambda item: sending.on_feedback(item.feedback)
        )
        if not session.wait_for(lambda: answer.done() or None, deadline):
            raise NoAnswer(f"'{name}' did not say within {deadline.timeout_s:g} s if it takes it")
        if not answer.result().accepted:
            raise Rejected(f"'{name}' rejected the goal")
        yield Goal(session, client, name, answer.result())
    finally:
        client.destroy()
