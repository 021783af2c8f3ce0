"""The action client port."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from functools import partial
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.client import ActionClient

from composer.behavior import CallCancelled, CallError, GoalRejected
from composer.model import Event, Port
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.queue import line_for
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.callbacks.timing import CallbackTimer
from composer.runtime.executors.tasks import Future
from composer.runtime.ports.client import DEFAULT_TIMEOUT_MS
from composer.runtime.ports.waiting import Waiting
from composer.runtime.ros.messages import interface_class
from composer.runtime.ros.qos_profiles import rclpy_profile

OnFeedback = Callable[[Any], Any]

_STATUS_NAMES = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}


@dataclass(frozen=True, slots=True)
class Ended:
    """How a goal ended; see :class:`composer.behavior.GoalResult`."""

    status: str
    result: Any


class SentGoal:
    """A goal that a server took; see :class:`composer.behavior.SentGoal`."""

    def __init__(self, port: ActionClientPort, handle: Any, ended: Future[Ended]) -> None:
        self._port = port
        self._handle = handle
        self._ended = ended

    def result(self, *, timeout_ms: float | None = None) -> Future[Ended]:
        """Wait for the end of the goal. Ends with CallTimeout or CallCancelled."""
        return self._port.follow(self._ended, timeout_ms)

    def cancel(self) -> Future[bool]:
        """Ask the server to cancel; true when it agreed. Ends with CallTimeout, CallCancelled."""
        return self._port.cancel(self._handle)


class ActionClientPort:
    """Sends goals. Feedback and results go to whoever sent the goal and to the port's reactions.

    Goals that are under way when the node leaves *active* are canceled: nobody would hear of
    their end.
    """

    def __init__(self, core: NodeContext, port: Port) -> None:
        self._core = core
        self._find_server = core.delivery.find_action_server(port)
        self._name = port.name.value
        self._timeout_ms = DEFAULT_TIMEOUT_MS if port.timeout_ms is None else port.timeout_ms.value
        limit = port.result_timeout_ms
        self._result_timeout_ms = None if limit is None else limit.value
        self._what = f"action '{port.full_name}'"
        self.action_type: Any = interface_class(port.interface.value)
        self._reactions: dict[Event, RunningReaction] = {}
        self._under_way: dict[bytes, Any] = {}
        traced = core.statistics.callback(port.kind.value, self._name)
        timer = CallbackTimer(core, traced, port.budget_ms)
        self._feedback = line_for(
            core, self._take_feedback, timer, depth=None, reentrant=port.reentrant
        )
        self._run = timer.around(self._carry_out)
        profile = rclpy_profile(port.qos.profile)
        self._client = ActionClient(
            core.node,
            self.action_type,
            port.full_name,
            callback_group=core.group,
            goal_service_qos_profile=profile,
            result_service_qos_profile=profile,
            cancel_service_qos_profile=profile,
        )
        core.loop.add_action_client(self._client)

    @property
    def content_type(self) -> Any:
        """The class of goals."""
        return self.action_type.Goal

    def react(self, event: Event, reaction: RunningReaction) -> None:
        """Run ``reaction`` on every feedback, result or failure of the port."""
        self._reactions[event] = reaction

    def send_goal(
        self,
        goal: Any,
        *,
        on_feedback: OnFeedback | None = None,
        timeout_ms: float | None = None,
    ) -> Future[SentGoal]:
        """Send ``goal`` now; the future is the accepted goal.

        It ends with ServerUnavailable, CallTimeout, CallCancelled or GoalRejected. Raises
        TypeError.
        """
        if not isinstance(goal, self.content_type):
            raise TypeError(
                f"action client '{self._name}' takes a {self.action_type.__name__}.Goal, "
                f"not {type(goal).__name__}"
            )
        limit_ms = self._timeout_ms if timeout_ms is None else timeout_ms
        return self._core.spawn(self._send_goal(goal, on_feedback, limit_ms))

    def send(self, content: Any) -> None:
        """Send a goal for a reaction; failures without ``on_failure`` are logged."""
        self._core.spawn(self._send(content))

    def follow(self, ended: Future[Ended], timeout_ms: float | None) -> Future[Ended]:
        """Wait for ``ended``, for at most ``timeout_ms``, without ending it."""
        view: Future[Ended] = Future()
        ended.add_done_callback(lambda done: _copy(done, view))
        waiting = Waiting(self._core, self._what, timeout_ms)
        return self._core.spawn(waiting.until_done(view))

    def cancel(self, handle: Any) -> Future[bool]:
        """Ask the server to cancel the goal."""
        return self._core.spawn(self._cancel(handle))

    def activate(self) -> None:
        """Do nothing: goals get out as soon as the gate is open."""

    def deactivate(self) -> None:
        """Cancel the goals that are under way; the gate ends whoever waits for them."""
        self._feedback.clear()
        for handle in tuple(self._under_way.values()):
            handle.cancel_goal_async()
        self._under_way.clear()

    def destroy(self) -> None:
        """Leave."""
        self._core.loop.remove(self._client)
        self._client.destroy()

    async def _send_goal(
        self, goal: Any, on_feedback: OnFeedback | None, timeout_ms: float
    ) -> SentGoal:
        try:
            waiting = Waiting(self._core, self._what, timeout_ms)
            await waiting.until_there(self._has_server)
            self._core.statistics.calls += 1
            handle = await waiting.until_done(self._ask(goal, on_feedback))
            if not handle.accepted:
                raise GoalRejected(f"{self._what} did not take the goal")
        except CallError as error:
            self._react(Event.FAILURE, failure=str(error), goal=goal)
            raise
        self._under_way[bytes(handle.goal_id.uuid)] = handle
        ended = self._core.spawn(self._end(goal, handle))
        ended.add_done_callback(lambda done: done.exception())  # nobody has to want the result
        return SentGoal(self, handle, ended)

    def _has_server(self) -> bool:
        return self._find_server() is not None or self._client.server_is_ready()

    def _ask(self, goal: Any, on_feedback: OnFeedback | None) -> Any:
        take = partial(self._on_feedback, goal, on_feedback)
        server = self._find_server()
        if server is None:
            return self._client.send_goal_async(goal, lambda message: take(message.feedback))
        call_soon = self._core.loop.call_soon
        return server.send_goal(goal, lambda feedback: call_soon(partial(take, feedback)))

    async def _end(self, goal: Any, handle: Any) -> Ended:
        try:
            waiting = Waiting(self._core, self._what, self._result_timeout_ms)
            answer = await waiting.until_done(handle.get_result_async())
        except CallError as error:
            self._react(Event.FAILURE, failure=str(error), goal=goal)
            raise
        finally:
            self._under_way.pop(bytes(handle.goal_id.uuid), None)
        status = _STATUS_NAMES.get(answer.status, "aborted")
        self._react(Event.RESULT, result=answer.result, status=status, goal=goal)
        return Ended(status, answer.result)

    async def _cancel(self, handle: Any) -> bool:
        waiting = Waiting(self._core, self._what, self._timeout_ms)
        answer = await waiting.until_done(handle.cancel_goal_async())
        return bool(answer.goals_canceling)

    async def _send(self, goal: Any) -> None:
        try:
            sent = await self._send_goal(goal, None, self._timeout_ms)
            await sent.result()
        except CallCancelled as error:
            self._core.log.debug(f"action client '{self._name}': {error}")
        except CallError as error:
            if Event.FAILURE not in self._reactions:
                self._core.error_log.error(f"action client '{self._name}'", str(error))

    def _on_feedback(self, goal: Any, on_feedback: OnFeedback | None, feedback: Any) -> None:
        if self._core.gate.incoming:
            self._feedback.put((goal, on_feedback, feedback))

    def _take_feedback(
        self, item: tuple[Any, OnFeedback | None, Any]
    ) -> Coroutine[Any, Any, None] | None:
        goal, on_feedback, feedback = item
        reaction = self._reactions.get(Event.FEEDBACK)
        if reaction is not None:
            self._carry_out((reaction, Event.FEEDBACK, {"feedback": feedback, "goal": goal}))
        if on_feedback is None:
            return None
        return self._core.call(f"feedback of '{self._name}'", on_feedback, feedback)

    def _react(self, event: Event, **values: Any) -> None:
        reaction = self._reactions.get(event)
        if reaction is not None and self._core.gate.incoming:
            self._core.strand.post(lambda: self._run((reaction, event, values)))

    def _carry_out(self, item: tuple[RunningReaction, Event, dict[str, Any]]) -> None:
        reaction, event, values = item
        try:
            reaction.run(**values)
        except Exception as error:
            self._core.error_log.exception(f"action client '{self._name}' on_{event}", error)


def _copy(done: Future[Ended], view: Future[Ended]) -> None:
    error = done.exception()
    if error is not None:
        view.set_exception(error)
    elif done.cancelled():
        view.cancel()
    else:
        view.set_result(done.result())
