"""The action server port, and the goals that it executes."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.server import CancelResponse, GoalEvent, GoalResponse, ServerGoalHandle
from rclpy.serialization import serialize_message
from unique_identifier_msgs.msg import UUID

from composer.base.fast_dataclass import dataclass
from composer.behavior import CallCancelled
from composer.model import FeedbackSteps, Port
from composer.runtime.callbacks.callback import CallbackTimer
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.queue import queue_for
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.executors.actions import GoalServer
from composer.runtime.executors.exceptions import describe, is_closing, shown, text_of
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.stacks import calls_user_code
from composer.runtime.executors.tasks import sleep, wait_for
from composer.runtime.intra_process.servers import LocalActionServer
from composer.runtime.intra_process.taps import GoalTap
from composer.runtime.ports import RunningPort
from composer.runtime.ros.messages import Build, compile_message, interface_class
from composer.runtime.ros.qos_profiles import rclpy_profile


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


#: Maximum time for handlers to end their goals once the node leaves *active*.
CANCEL_LIMIT_S = 1.0


@dataclass(frozen=True, slots=True)
class Handlers:
    """A behavior's handlers of an action server: ``on_<port>`` and ``accept_<port>``."""

    execute: Callable[[RunningGoal], Any] | None = None
    accept: Callable[[Any], Any] | None = None


class ActionServerPort(RunningPort):
    """Executes goals while the node is active, one at a time unless the port is reentrant.

    Waiting goals are accepted and can be canceled. Goals beyond the depth of the port's QoS are
    rejected.
    """

    def __init__(
        self, context: NodeContext, port: Port, reaction: RunningReaction | None, handlers: Handlers
    ) -> None:
        """Create the server. Raises MessageError."""
        self._context = context
        self._name = port.name.value
        self._callback = f"action server '{self._name}'"
        self._type = interface_class(port.interface.value)
        self._accepts = port.accept.holds if port.accept is not None else None
        self._reaction = reaction
        self._handlers = handlers
        self._steps = port.feedback
        self._feedback = _compile_feedback(port.feedback, self._type)
        self._result: Build | None = None
        if port.result is not None:
            self._result = compile_message(port.result, self._type.Result, "'result'")
        self._goals: dict[bytes, RunningGoal] = {}
        self._limit = None if port.reentrant else port.qos.profile.queue_depth
        self._count = 0
        statistics = context.statistics.callback(port.kind.value, self._name)
        self._timer = CallbackTimer(context, statistics, port.budget_ms)
        self._queue = queue_for(context, self._run, None, depth=None, reentrant=port.reentrant)
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

    def deactivate(self) -> None:
        """Cancel the waiting goals and request cancellation of the running ones."""
        for goal in self._queue.clear():
            self._end(goal, None, canceled=True)
        for goal in self._goals.values():
            goal.request_cancel()

    async def drain(self) -> None:
        """Wait until the handlers have ended their goals; after a time limit, cancel them."""
        for goal in tuple(self._goals.values()):
            if not await wait_for(self._context.loop, goal.ended, CANCEL_LIMIT_S):
                self._context.log.warn(
                    f"{self._callback}: a goal did not end within {CANCEL_LIMIT_S:g} s, canceled"
                )
                self._force_cancel(goal)

    def destroy(self) -> None:
        """Cancel the remaining goals and destroy the server."""
        self._remove()
        for goal in tuple(self._goals.values()):
            self._force_cancel(goal)
        self._context.loop.remove(self._server)
        self._server.destroy()

    # --- requests

    async def _on_goal_request(self, request: Any) -> GoalResponse:
        try:
            reason = await self._rejection(request)
        except BaseException as error:
            self._context.on_exception(f"accept_{self._name}", error)
            return GoalResponse.REJECT
        if reason is None:
            return GoalResponse.ACCEPT
        self._context.log.info(f"{self._callback} rejects a goal: {reason}")
        return GoalResponse.REJECT

    @calls_user_code
    async def _rejection(self, request: Any) -> str | None:
        """Return why the goal is rejected, or None if it is accepted."""
        if not self._context.gate.incoming:
            return self._context.gate.refusal
        if self._limit is not None and len(self._goals) > self._limit:
            return f"{self._limit} goals are waiting already"
        if self._accepts is not None and not self._accepts(self._context.names | {"goal": request}):
            return "it does not fulfill 'accept'"
        if self._handlers.accept is not None:
            accepted = self._handlers.accept(request)
            if isinstance(accepted, Awaitable):
                accepted = await accepted
            if accepted is not True:
                return f"accept_{self._name} returned {shown(accepted)}"
        return None if self._context.gate.incoming else self._context.gate.refusal

    def _on_accepted(self, handle: ServerGoalHandle) -> None:
        goal = RunningGoal(handle, self._publish_feedback)
        self._context.statistics.calls += 1
        self._goals[goal.identity] = goal
        self._queue.put(goal)

    def _publish_feedback(self, goal_id: UUID, feedback: Any) -> None:
        self._tap.feedback(goal_id, feedback)
        self._local.publish_feedback(bytes(goal_id.uuid), feedback)

    def _on_cancel_request(self, handle: ServerGoalHandle) -> CancelResponse:
        goal = self._goals.get(bytes(handle.goal_id.uuid))
        if goal is not None and not goal.has_begun:
            # It is waiting. rclpy sets its status to canceling after this call.
            self._context.loop.call_soon(lambda: self._end(goal, None, canceled=True))
        return CancelResponse.ACCEPT

    # --- execution

    def _run(self, goal: RunningGoal) -> Coroutine[Any, Any, None] | None:
        if not goal.is_open:
            return None  # canceled while it waited
        goal.has_begun = True
        goal.execute()
        steps = self._timer.wrap_steps(self._execute(goal))
        goal.task = self._context.spawn(self._context.strand.wrap(steps))
        return self._follow(goal, goal.task)

    async def _follow(self, goal: RunningGoal, task: Future[Any]) -> None:
        """End the goal when its execution ends, however it ends."""
        try:
            result = await task
        except Cancelled:
            self._end(goal, None, canceled=True)
        except CallCancelled as error:
            self._context.log.debug(f"{self._callback}: {text_of(error)}")
            self._end(goal, None, canceled=True)
        except BaseException as error:
            if is_closing(error):
                raise
            name = f"on_{self._name}" if self._handlers.execute else self._callback
            self._context.error_log.exception(name, error)
            self._end(goal, None, canceled=False)
        else:
            self._finish(goal, result)

    @calls_user_code
    async def _execute(self, goal: RunningGoal) -> Any:
        scope = self._context.names | {"goal": goal.request}
        scope |= {"count": self._count, "now": self._context.now_s()}
        self._count += 1
        if self._reaction is not None:
            self._reaction.run(goal=goal.request)
        if self._steps is not None:
            await self._publish_feedback_steps(goal, self._steps, scope)
        result = None
        if self._handlers.execute is not None:
            result = self._handlers.execute(goal)
            if isinstance(result, Awaitable):
                result = await result
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

    # --- results

    def _finish(self, goal: RunningGoal, result: Any) -> None:
        """End the goal unless its handler has ended it.

        It succeeds, or is canceled if that was requested.
        """
        objection = self._objection(result)
        if objection:
            self._context.error_log.error(f"on_{self._name}", objection)
            self._end(goal, None, canceled=False)
            return
        if goal.is_open:
            if goal.is_cancel_requested:
                goal.canceled()
            else:
                goal.succeed()
        self._end(goal, result, canceled=False)

    def _objection(self, result: Any) -> str:
        """Return why a handler's result cannot be sent; empty if it can."""
        if result is None:
            return ""
        if not issubclass(type(result), self._type.Result):
            return f"returned {shown(result)}, not a {self._type.__name__}.Result"
        try:
            serialize_message(result)
        except Exception as error:  # such as a string that is not valid Unicode
            return f"returned a result that cannot be sent: {describe(error)}"
        return ""

    def _force_cancel(self, goal: RunningGoal) -> None:
        self._end(goal, None, canceled=True)
        if goal.task is not None:
            goal.task.cancel()

    def _end(self, goal: RunningGoal, result: Any, *, canceled: bool) -> None:
        """Cancel or abort a goal that is still open, and send its result, once."""
        if self._goals.pop(goal.identity, None) is None:
            return
        if goal.is_open:
            if canceled:
                goal.canceled()
            else:
                goal.abort()
        response = self._type.Impl.GetResultService.Response()
        response.status = goal.status
        response.result = self._type.Result() if result is None else result
        self._server.end(goal.identity, response)
        goal.ended.set_result(None)


def _compile_feedback(steps: FeedbackSteps | None, action_type: Any) -> Build | None:
    if steps is None or steps.content is None:
        return None
    return compile_message(steps.content, action_type.Feedback, "'feedback'")


def _unused_execute_callback(_: Any) -> None:
    """Satisfy rclpy, which requires a callback; the port executes goals itself."""
