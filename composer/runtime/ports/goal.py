"""One goal at an action server, from its acceptance until it has ended."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.server import GoalEvent, ServerGoalHandle

from composer.runtime.executors.futures import Future


class RunningGoal:
    """The goal that an action handler gets; see :class:`composer.behavior.Goal`.

    In rclpy a goal can only be canceled on a client's request. Here the node may cancel it too,
    because it leaves *active* or because the handler does so.
    """

    def __init__(
        self, handle: ServerGoalHandle, publish_local: Callable[[bytes, Any], None]
    ) -> None:
        """``publish_local`` gets the goal's identity and feedback for clients of the process."""
        self._handle = handle
        self._publish_local = publish_local
        self._is_node_leaving = False
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
        """Whether the goal has not succeeded, aborted or been canceled yet."""
        return bool(self._handle.is_active)

    @property
    def status(self) -> int:
        """The status, a constant of action_msgs/msg/GoalStatus."""
        return int(self._handle.status)

    @property
    def is_cancel_requested(self) -> bool:
        """Whether a client requested cancellation, or the node is leaving the active state."""
        return self._is_node_leaving or bool(self._handle.is_cancel_requested)

    def execute(self) -> None:
        """Set the status to executing, unless the goal is being canceled."""
        if self.status == GoalStatus.STATUS_ACCEPTED:
            self._handle._update_state(GoalEvent.EXECUTE)

    def request_cancel(self) -> None:
        """Notify the handler that the node is leaving the active state."""
        self._is_node_leaving = True

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the client. Raises TypeError for another type than the Feedback."""
        if self.is_open:
            self._handle.publish_feedback(feedback)
            self._publish_local(self.identity, feedback)

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
