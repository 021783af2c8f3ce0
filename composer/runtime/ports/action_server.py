"""The action server port, and the goals that it executes."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.server import CancelResponse, GoalEvent, GoalResponse, ServerGoalHandle
from rclpy.serialization import serialize_message
from unique_identifier_msgs.msg import UUID

from composer.model import FeedbackSteps, Port
from composer.runtime.callbacks.callback import CallbackTimer
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.executors.actions import GoalServer
from composer.runtime.executors.futures import Future
from composer.runtime.executors.tasks import sleep
from composer.runtime.executors.tracebacks import describe
from composer.runtime.intra_process.servers import LocalActionServer
from composer.runtime.intra_process.taps import GoalTap
from composer.runtime.ports.goals import GoalExecutor, Handlers
from composer.runtime.ros.conversions import rclpy_profile
from composer.runtime.ros.messages import Build, compile_message, interface_class


class RunningGoal:
    """The goal that an action handler gets; see :class:`composer.behavior.Goal`.

    In rclpy a goal can only be canceled on a client's request. Here the node may cancel it too,
    because it leaves *active* or because the handler does so.
    """

    def __init__(
        self, handle: ServerGoalHandle, publish_local: Callable[[UUID, Any], None]
    ) -> None:
        """``publish_local`` gets the goal's id and feedback, for receivers in the process."""
        self._handle = handle
        self._publish_local = publish_local
        self._is_node_leaving = False
        self.has_begun = False  # before its task, which another thread may run at once
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
            self._publish_local(self._handle.goal_id, feedback)

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


class ActionServerPort(GoalExecutor[RunningGoal]):
    """Executes the goals of an action server of rclpy."""

    _context: NodeContext

    def __init__(
        self, context: NodeContext, port: Port, reaction: RunningReaction | None, handlers: Handlers
    ) -> None:
        """Create the server. Raises MessageError."""
        super().__init__(context, port, interface_class(port.interface.value), handlers)
        self._reaction = reaction
        self._feedback_steps = port.feedback
        self._feedback = _compile_feedback(port.feedback, self._type)
        self._result: Build | None = None
        if port.result is not None:
            self._result = compile_message(port.result, self._type.Result, "'result'")
        self._count = 0
        statistics = context.statistics.callback(port.kind.value, self._name)
        self._timer = CallbackTimer(context, statistics, port.budget_ms)
        profile = rclpy_profile(port.qos.profile)
        self._server = GoalServer(
            context.node,
            self._type,
            port.full_name,
            clock=context.loop.clock,
            execute_callback=_unused_execute_callback,
            callback_group=context.group_of(port),
            goal_callback=self._on_goal_request,
            handle_accepted_callback=self._on_accepted,
            cancel_callback=self._on_cancel_request,
            goal_service_qos_profile=profile,
            result_service_qos_profile=profile,
            cancel_service_qos_profile=profile,
        )
        self._tap = GoalTap(context.router.recorder, port, self._server, context.loop.clock)
        context.loop.add_action_server(self._server)
        self._local = LocalActionServer(port, self._server, context.loop.run_task)
        self._remove = context.router.add_action_server(port, self._local)

    def destroy(self) -> None:
        """Cancel the remaining goals and destroy the server."""
        self._remove()
        super().destroy()
        self._context.loop.remove(self._server)
        self._server.destroy()

    # --- requests

    async def _on_goal_request(self, request: Any) -> GoalResponse:
        is_accepted = await self._is_accepted(request)
        return GoalResponse.ACCEPT if is_accepted else GoalResponse.REJECT

    def _on_accepted(self, handle: ServerGoalHandle) -> None:
        self._start(RunningGoal(handle, self._publish_feedback))

    def _publish_feedback(self, goal_id: UUID, feedback: Any) -> None:
        self._tap.feedback(goal_id, feedback)
        self._local.publish_feedback(bytes(goal_id.uuid), feedback)

    def _on_cancel_request(self, handle: ServerGoalHandle) -> CancelResponse:
        identity = bytes(handle.goal_id.uuid)
        goals = tuple(self._goals)  # another thread may change it
        goal = next((item for item in goals if item.identity == identity), None)
        if goal is not None and not goal.has_begun:
            # It is waiting. rclpy sets its status to canceling after this call.
            self._context.loop.call_soon(lambda: self._end(goal, None, canceled=True))
        return CancelResponse.ACCEPT

    # --- execution

    def _steps(self, goal: RunningGoal) -> Coroutine[Any, Any, Any]:
        return self._timer.wrap_steps(super()._steps(goal))

    async def _execute(self, goal: RunningGoal) -> Any:
        scope = self._context.names | {"goal": goal.request}
        scope |= {"count": self._count, "now": self._context.now_s()}
        self._count += 1
        if self._reaction is not None:
            self._reaction.run(goal=goal.request)
        if self._feedback_steps is not None:
            await self._publish_feedback_steps(goal, self._feedback_steps, scope)
        result = await super()._execute(goal)
        if result is None and self._result is not None and not goal.is_cancel_requested:
            result = self._result(scope)
        return result

    async def _publish_feedback_steps(
        self, goal: RunningGoal, steps: FeedbackSteps, scope: dict[str, Any]
    ) -> None:
        for step in range(steps.count.value):
            if goal.is_cancel_requested:
                return
            if self._feedback is not None:
                now = {"count": step, "now": self._context.now_s()}
                goal.publish_feedback(self._feedback(scope | now))
            pause = sleep(self._context.clock, steps.period_ms.value / 1000.0)
            await self._context.gate.pending.add(pause)

    def _objection(self, result: Any) -> str:
        if objection := super()._objection(result):
            return objection
        try:
            if result is not None:
                serialize_message(result)
        except Exception as error:  # such as a string that is not valid Unicode
            return f"returned a result that cannot be sent: {describe(error)}"
        return ""

    def _send_result(self, goal: RunningGoal, result: Any) -> None:
        response = self._type.Impl.GetResultService.Response()
        response.status = goal.status
        response.result = result
        self._server.end(goal.identity, response)


def _compile_feedback(steps: FeedbackSteps | None, action_type: Any) -> Build | None:
    if steps is None or steps.content is None:
        return None
    return compile_message(steps.content, action_type.Feedback, "'feedback'")


def _unused_execute_callback(_: Any) -> None:
    """Satisfy rclpy, which requires a callback; the port executes goals itself."""
