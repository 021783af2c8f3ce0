"""The action client port."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.client import ActionClient

from composer.behavior import CallError, GoalRejected
from composer.model import Event, Port
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.user_code import queue_for
from composer.runtime.executors.futures import Future, wrap_future
from composer.runtime.ports.goals import GoalOutcome
from composer.runtime.ports.services import CallingPort, CallLimit
from composer.runtime.ros.conversions import rclpy_profile
from composer.runtime.ros.messages import interface_class

OnFeedback = Callable[[Any], Any]

_STATUS_NAMES = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}


class ClientGoal:
    """A goal that the server accepted; see :class:`composer.behavior.SentGoal`."""

    def __init__(self, port: ActionClientPort, handle: Any, outcome: Future[GoalOutcome]) -> None:
        self._port = port
        self._handle = handle
        self._outcome = outcome

    def result(self, *, timeout_ms: float | None = None) -> Future[GoalOutcome]:
        """Wait until the goal has ended. Fails with CallTimeout or CallCancelled."""
        return self._port.follow(self._outcome, timeout_ms)

    def cancel(self) -> Future[bool]:
        """Request cancellation; true if accepted. Fails with CallTimeout or CallCancelled."""
        return self._port.cancel(self._handle)


class ActionClientPort(CallingPort):
    """Sends goals. Feedback and results go to the sender and to the port's own reactions.

    Goals that are running when the node leaves *active* are canceled, since their results would
    not be handled.
    """

    def __init__(self, context: NodeContext, port: Port) -> None:
        super().__init__(context, port, "action")
        self._find_server = context.router.action_server_lookup(port)
        limit = port.result_timeout_ms
        self._result_timeout_ms = None if limit is None else limit.value
        self.action_type: Any = interface_class(port.interface.value)
        self._running: dict[bytes, Any] = {}
        self._feedback = queue_for(
            context, self._handle_feedback, self._timer, depth=None, reentrant=port.reentrant
        )
        profile = rclpy_profile(port.qos.profile)
        self._client = ActionClient(
            context.node,
            self.action_type,
            port.full_name,
            callback_group=context.group,
            goal_service_qos_profile=profile,
            result_service_qos_profile=profile,
            cancel_service_qos_profile=profile,
        )
        context.loop.add_action_client(self._client)

    @property
    def content_type(self) -> Any:
        """The class of goals."""
        return self.action_type.Goal

    def send_goal(
        self,
        goal: Any,
        *,
        on_feedback: OnFeedback | None = None,
        timeout_ms: float | None = None,
    ) -> Future[ClientGoal]:
        """Send ``goal`` now; return the future of the accepted goal.

        It fails with ServerUnavailable, CallTimeout, CallCancelled or GoalRejected. Raises
        TypeError.
        """
        self._check_type(goal, self.content_type, f"{self.action_type.__name__}.Goal")
        limit_ms = self._timeout_ms if timeout_ms is None else timeout_ms
        return self._context.spawn(self._send_goal(goal, on_feedback, limit_ms))

    def follow(self, outcome: Future[GoalOutcome], timeout_ms: float | None) -> Future[GoalOutcome]:
        """Wait for ``outcome`` for up to ``timeout_ms``, without canceling it."""
        limit = CallLimit(self._context, self._what, timeout_ms)
        return self._context.spawn(limit.wait_for_response(wrap_future(outcome, cancels=False)))

    def cancel(self, handle: Any) -> Future[bool]:
        """Request the cancellation of a goal; true if the server accepts."""
        return self._context.spawn(self._cancel(handle))

    def deactivate(self) -> None:
        """Cancel the running goals; the gate ends the pending calls."""
        self._feedback.clear()
        for handle in tuple(self._running.values()):
            handle.cancel_goal_async()
        self._running.clear()

    def destroy(self) -> None:
        """Destroy the client."""
        self._context.loop.remove(self._client)
        self._client.destroy()

    async def _send_goal(
        self, goal: Any, on_feedback: OnFeedback | None, timeout_ms: float
    ) -> ClientGoal:
        try:
            limit = CallLimit(self._context, self._what, timeout_ms)
            await limit.wait_for_server(self._has_server)
            self._context.statistics.calls += 1
            handle = await limit.wait_for_response(self._send_goal_request(goal, on_feedback))
            if not handle.accepted:
                raise GoalRejected(f"{self._what} rejected the goal")
        except CallError as error:
            self._react(Event.FAILURE, failure=str(error), goal=goal)
            raise
        self._running[bytes(handle.goal_id.uuid)] = handle
        outcome = self._context.spawn(self._wait_for_outcome(goal, handle))
        outcome.add_done_callback(lambda done: done.exception())  # it need not be retrieved
        return ClientGoal(self, handle, outcome)

    def _has_server(self) -> bool:
        return self._find_server() is not None or self._client.server_is_ready()

    def _send_goal_request(self, goal: Any, on_feedback: OnFeedback | None) -> Any:
        receive = partial(self._on_feedback, goal, on_feedback)
        server = self._find_server()
        if server is None:
            return self._client.send_goal_async(goal, lambda message: receive(message.feedback))
        call_soon = self._context.loop.call_soon
        return server.send_goal(goal, lambda feedback: call_soon(partial(receive, feedback)))

    async def _wait_for_outcome(self, goal: Any, handle: Any) -> GoalOutcome:
        try:
            limit = CallLimit(self._context, self._what, self._result_timeout_ms)
            response = await limit.wait_for_response(handle.get_result_async())
        except CallError as error:
            self._react(Event.FAILURE, failure=str(error), goal=goal)
            raise
        finally:
            self._running.pop(bytes(handle.goal_id.uuid), None)
        status = _STATUS_NAMES.get(response.status, "aborted")
        self._react(Event.RESULT, result=response.result, status=status, goal=goal)
        return GoalOutcome(status, response.result)

    async def _cancel(self, handle: Any) -> bool:
        limit = CallLimit(self._context, self._what, self._timeout_ms)
        response = await limit.wait_for_response(handle.cancel_goal_async())
        return bool(response.goals_canceling)

    async def _complete(self, content: Any) -> None:
        sent = await self._send_goal(content, None, self._timeout_ms)
        await sent.result()

    def _on_feedback(self, goal: Any, on_feedback: OnFeedback | None, feedback: Any) -> None:
        if self._context.gate.incoming:
            self._feedback.put((goal, on_feedback, feedback))

    def _handle_feedback(
        self, item: tuple[Any, OnFeedback | None, Any]
    ) -> Coroutine[Any, Any, None] | None:
        goal, on_feedback, feedback = item
        reaction = self._reactions.get(Event.FEEDBACK)
        if reaction is not None:
            self._run_reaction((reaction, Event.FEEDBACK, {"feedback": feedback, "goal": goal}))
        if on_feedback is None:
            return None
        return self._context.call(f"feedback of '{self._name}'", on_feedback, feedback)
