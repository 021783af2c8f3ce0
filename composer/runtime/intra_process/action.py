"""An action server as the clients of its own process see it.

A goal of theirs is one of rclpy's server like any other: outsiders see its status, hear its
feedback and may cancel it. Only what its client is told comes straight.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

from rclpy.action.server import ActionServer
from unique_identifier_msgs.msg import UUID

from composer.model import Isolation, Port
from composer.runtime.executors import actions
from composer.runtime.executors.tasks import Future
from composer.runtime.intra_process.copying import copy_of

Spawn = Callable[[Coroutine[Any, Any, Any]], Future[Any]]
OnFeedback = Callable[[Any], None]


class LocalActionServer:
    """Takes goals and cancellations to the server's loop, and brings back what becomes of them."""

    def __init__(self, port: Port, server: ActionServer, spawn: Spawn) -> None:
        """``spawn`` runs a coroutine on the loop of the server."""
        self._server = server
        self._spawn = spawn
        self._passed: Callable[[Any], Any] = _as_it_is
        if port.isolation is Isolation.COPY:
            self._passed = copy_of
        self._listeners: dict[bytes, OnFeedback] = {}

    def send_goal(self, goal: Any, on_feedback: OnFeedback) -> Future[LocalGoal]:
        """Send a goal, from any thread; the future is its handle, accepted or not.

        ``on_feedback`` is called on the server's loop.
        """
        goal_id = UUID(uuid=list(uuid4().bytes))
        handle = LocalGoal(goal_id, self)
        answer: Future[LocalGoal] = Future()
        self._spawn(self._take_goal(handle, self._passed(goal), on_feedback, answer))
        return answer

    def give_feedback(self, goal_id: bytes, feedback: Any) -> None:
        """Tell the client of the process whose goal it is, if it is one's."""
        listener = self._listeners.get(goal_id)
        if listener is not None:
            listener(self._passed(feedback))

    def result(self, handle: LocalGoal) -> Future[Any]:
        """Return the future result, with its status, as by DDS."""
        answer: Future[Any] = Future()
        self._spawn(self._take_result_request(handle, answer))
        return answer

    def cancel(self, handle: LocalGoal) -> Future[Any]:
        """Ask for the goal's end; the future is the response to a cancellation, as by DDS."""
        answer: Future[Any] = Future()
        self._spawn(self._take_cancellation(handle, answer))
        return answer

    async def _take_goal(
        self, handle: LocalGoal, goal: Any, on_feedback: OnFeedback, answer: Future[LocalGoal]
    ) -> None:
        identity = bytes(handle.goal_id.uuid)
        self._listeners[identity] = on_feedback

        def tell(accepted: bool) -> None:
            if not accepted:
                del self._listeners[identity]
            handle.accepted = accepted
            answer.set_result(handle)

        await actions.take_goal(self._server, handle.goal_id, goal, tell)

    async def _take_result_request(self, handle: LocalGoal, answer: Future[Any]) -> None:
        identity = bytes(handle.goal_id.uuid)

        def end(response: Any) -> None:
            self._listeners.pop(identity, None)
            response.result = self._passed(response.result)
            answer.set_result(response)

        actions.when_ended(self._server, identity, end)

    async def _take_cancellation(self, handle: LocalGoal, answer: Future[Any]) -> None:
        answer.set_result(await actions.cancel_goal(self._server, handle.goal_id))


@dataclass(slots=True, eq=False)
class LocalGoal:
    """A goal as its sender holds it; the part of ``rclpy.action.client.ClientGoalHandle`` used."""

    goal_id: UUID
    server: LocalActionServer
    accepted: bool = False

    def get_result_async(self) -> Future[Any]:
        """Return the future result."""
        return self.server.result(self)

    def cancel_goal_async(self) -> Future[Any]:
        """Ask for the end of it."""
        return self.server.cancel(self)


def _as_it_is(value: Any) -> Any:
    return value
