"""The action server port."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle

from composer.behavior import CallCancelled
from composer.model import FeedbackSteps, Port
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.queue import line_for
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.callbacks.timing import CallbackTimer
from composer.runtime.executors.tasks import Cancelled, Future, sleep, within
from composer.runtime.executors.user_code import calls_user_code
from composer.runtime.intra_process.action import LocalActionServer
from composer.runtime.ports.goal import RunningGoal
from composer.runtime.ports.port import callback_group
from composer.runtime.ros.messages import Build, compile_message, interface_class
from composer.runtime.ros.qos_profiles import rclpy_profile

#: How long handlers may take to end their goals once the node leaves *active*.
CANCEL_LIMIT_S = 1.0


@dataclass(frozen=True, slots=True)
class Handlers:
    """What a behaviour has for an action server: ``on_<port>`` and ``accept_<port>``."""

    execute: Callable[[RunningGoal], Any] | None = None
    accept: Callable[[Any], Any] | None = None


class ActionServerPort:
    """Takes goals while the node is active, one at a time unless the port is reentrant.

    Goals that wait for their turn are accepted and can be canceled; more than the depth of the
    port's QoS do not wait but are rejected.
    """

    def __init__(
        self, core: NodeContext, port: Port, reaction: RunningReaction | None, handlers: Handlers
    ) -> None:
        """Join the action. Raises MessageError."""
        self._core = core
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
        traced = core.statistics.callback(port.kind.value, self._name)
        self._timer = CallbackTimer(core, traced, port.budget_ms)
        self._line = line_for(core, self._run, None, depth=None, reentrant=port.reentrant)
        profile = rclpy_profile(port.qos.profile)
        self._server = ActionServer(
            core.node,
            self._type,
            port.full_name,
            execute_callback=_never_called,
            callback_group=callback_group(core, port),
            goal_callback=self._decide,
            handle_accepted_callback=self._take,
            cancel_callback=self._cancel,
            goal_service_qos_profile=profile,
            result_service_qos_profile=profile,
            cancel_service_qos_profile=profile,
        )
        core.loop.add_action_server(self._server)
        self._local = LocalActionServer(port, self._server, core.loop.run_task)
        self._leave = core.delivery.add_action_server(port, self._local)

    def activate(self) -> None:
        """Do nothing: goals get in as soon as the gate is open."""

    def deactivate(self) -> None:
        """Cancel the goals that wait and tell the handlers of the others to end them."""
        for goal in self._line.clear():
            self._end(goal, None, canceled=True)
        for goal in self._goals.values():
            goal.leave()

    async def drain(self) -> None:
        """Wait until the handlers have ended their goals; after a while end them ourselves."""
        for goal in tuple(self._goals.values()):
            try:
                await within(self._core.loop, _view(goal.ended), CANCEL_LIMIT_S)
            except TimeoutError:
                self._core.log.warn(f"{self._callback}: a goal did not end, it is canceled now")
                self._force(goal)

    def destroy(self) -> None:
        """End what is left and leave."""
        self._leave()
        for goal in tuple(self._goals.values()):
            self._force(goal)
        self._core.loop.remove(self._server)
        self._server.destroy()

    # --- before the goal

    async def _decide(self, request: Any) -> GoalResponse:
        try:
            reason = await self._objection(request)
        except BaseException as error:
            self._core.take(f"accept_{self._name}", error)
            return GoalResponse.REJECT
        if reason is None:
            return GoalResponse.ACCEPT
        self._core.log.info(f"{self._callback} rejects a goal: {reason}")
        return GoalResponse.REJECT

    @calls_user_code
    async def _objection(self, request: Any) -> str | None:
        """Return why the goal is not taken, or None when it is."""
        if not self._core.gate.incoming:
            return self._core.gate.refusal
        if self._limit is not None and len(self._goals) > self._limit:
            return f"{self._limit} goals are waiting already"
        if self._accepts is not None and not self._accepts(self._core.names | {"goal": request}):
            return "it does not fulfil 'accept'"
        if self._handlers.accept is not None:
            answer = self._handlers.accept(request)
            if isinstance(answer, Awaitable):
                answer = await answer
            if answer is not True:
                return f"accept_{self._name} returned {answer!r:.80}"
        return None if self._core.gate.incoming else self._core.gate.refusal

    def _take(self, handle: ServerGoalHandle) -> None:
        goal = RunningGoal(handle, self._local.give_feedback)
        self._core.statistics.calls += 1
        self._goals[goal.identity] = goal
        self._line.put(goal)

    def _cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        goal = self._goals.get(bytes(handle.goal_id.uuid))
        if goal is not None and goal.task is None:
            # It waits for its turn. rclpy marks it as canceling after this call.
            self._core.loop.call_soon(lambda: self._end(goal, None, canceled=True))
        return CancelResponse.ACCEPT

    # --- the goal

    def _run(self, goal: RunningGoal) -> Coroutine[Any, Any, None] | None:
        if not goal.is_open:
            return None  # canceled while it waited
        goal.execute()
        goal.task = self._core.spawn(self._core.strand.wrap(self._timer.steps(self._work(goal))))
        return self._follow(goal, goal.task)

    async def _follow(self, goal: RunningGoal, task: Future[Any]) -> None:
        """See the goal to its end, whatever becomes of the work on it."""
        try:
            result = await task
        except Cancelled:
            self._end(goal, None, canceled=True)
        except CallCancelled as error:
            self._core.log.debug(f"{self._callback}: {error}")
            self._end(goal, None, canceled=True)
        except BaseException as error:
            name = f"on_{self._name}" if self._handlers.execute else self._callback
            self._core.error_log.exception(name, error)
            self._end(goal, None, canceled=False)
        else:
            self._finish(goal, result)

    @calls_user_code
    async def _work(self, goal: RunningGoal) -> Any:
        scope = self._core.names | {"goal": goal.request}
        scope |= {"count": self._count, "now": self._core.now_s()}
        self._count += 1
        if self._reaction is not None:
            self._reaction.run(goal=goal.request)
        if self._steps is not None:
            await self._give_feedback(goal, self._steps, scope)
        result = None
        if self._handlers.execute is not None:
            result = self._handlers.execute(goal)
            if isinstance(result, Awaitable):
                result = await result
        if result is None and self._result is not None and not goal.is_cancel_requested:
            result = self._result(scope)
        return result

    async def _give_feedback(
        self, goal: RunningGoal, steps: FeedbackSteps, scope: dict[str, Any]
    ) -> None:
        for step in range(steps.count.value):
            if goal.is_cancel_requested:
                return
            if self._feedback is not None:
                now = {"count": step, "now": self._core.now_s()}
                goal.publish_feedback(self._feedback(scope | now))
            pause = sleep(self._core.clock, steps.period_ms.value / 1000.0)
            await self._core.gate.pending.hold(pause)

    # --- after the goal

    def _finish(self, goal: RunningGoal, result: Any) -> None:
        """End the goal as its handler left it.

        Unless that named the end itself, the goal has succeeded, or is canceled where that was
        asked for.
        """
        if result is not None and not isinstance(result, self._type.Result):
            wanted = f"{self._type.__name__}.Result"
            self._core.error_log.error(
                f"on_{self._name}", f"returned {result!r:.80}, not a {wanted}"
            )
            self._end(goal, None, canceled=False)
            return
        if goal.is_open:
            if goal.is_cancel_requested:
                goal.canceled()
            else:
                goal.succeed()
        self._end(goal, result, canceled=False)

    def _force(self, goal: RunningGoal) -> None:
        self._end(goal, None, canceled=True)
        if goal.task is not None:
            goal.task.cancel()

    def _end(self, goal: RunningGoal, result: Any, *, canceled: bool) -> None:
        """Bring a goal that is still open to its end, once, and send the result."""
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
        self._server._result_futures[goal.identity].set_result(response)
        goal.ended.set_result(None)


def _compile_feedback(steps: FeedbackSteps | None, action_type: Any) -> Build | None:
    if steps is None or steps.content is None:
        return None
    return compile_message(steps.content, action_type.Feedback, "'feedback'")


def _view(future: Future[None]) -> Future[None]:
    """Return a future that ends with ``future`` but can be given up without ending it."""
    view: Future[None] = Future()
    future.add_done_callback(lambda _: view.set_result(None))
    return view


def _never_called(_: Any) -> None:
    """Stand where rclpy wants a callback; the port runs goals itself."""
