"""One goal at an action server, from its acceptance to its end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.server import GoalEvent, ServerGoalHandle

from composer.runtime.executors.tasks import Future


class RunningGoal:
    """What an action handler gets; see :class:`composer.behavior.Goal`.

    rclpy lets a goal end as canceled only when a client asked for it. Here the node may end one
    too, because it leaves *active* or because its handler says so.
    """

    def __init__(
        self, handle: ServerGoalHandle, give_feedback: Callable[[bytes, Any], None]
    ) -> None:
        """``give_feedback`` takes the goal's identity, and feedback for who is in the process."""
        self._handle = handle
        self._give_feedback = give_feedback
        self._leaving = False
        self.task: Future[Any] | None = None
        self.ended: Future[None] = Future()

    @property
    def request(self) -> Any:
        """The goal message."""
        return self._handle.request

    @property
    def identity(self) -> bytes:
        """The goal's UUID."""
        return bytes(self._handle.goal_id.uuid)

    @property
    def is_open(self) -> bool:
        """True until the goal has ended in one of the three ways."""
        return bool(self._handle.is_active)

    @property
    def status(self) -> int:
        """The status as action_msgs/msg/GoalStatus numbers it."""
        return int(self._handle.status)

    @property
    def is_cancel_requested(self) -> bool:
        """True once the client asked for the end, or the node is leaving the active state."""
        return self._leaving or bool(self._handle.is_cancel_requested)

    def execute(self) -> None:
        """Say that work on the goal begins, unless it is to be canceled already."""
        if self.status == GoalStatus.STATUS_ACCEPTED:
            self._handle._update_state(GoalEvent.EXECUTE)

    def leave(self) -> None:
        """Tell the handler that the node is leaving the active state."""
        self._leaving = True

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the client. Raises TypeError when it is not the action's Feedback."""
        if self.is_open:
            self._handle.publish_feedback(feedback)
            self._give_feedback(self.identity, feedback)

    def succeed(self) -> None:
        """End the goal as succeeded."""
        self._handle.succeed()

    def abort(self) -> None:
        """End the goal as aborted."""
        self._handle.abort()

    def canceled(self) -> None:
        """End the goal as canceled."""
        if self.status in (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING):
            self._handle._update_state(GoalEvent.CANCEL_GOAL)
        self._handle.canceled()
