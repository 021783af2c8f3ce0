"""Action servers and clients: rclpy's own code does the work, as under its executors.

Together with :mod:`composer.runtime.executors.entity_sources`, what reaches into rclpy.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from rclpy.action.client import ActionClient
from rclpy.action.server import (
    ActionServer,
    CancelResponse,
    GoalEvent,
    GoalResponse,
    RCLError,
    ServerGoalHandle,
)
from rclpy.task import Future as RclpyFuture
from unique_identifier_msgs.msg import UUID

from composer.runtime.executors import readiness
from composer.runtime.executors.readiness import Announcement, Handle, Signal
from composer.runtime.executors.tasks import Cancelled, Clock, Future, Report, name_of

T = TypeVar("T")


class TaskLoop(Clock, Protocol):
    """The part of a loop that actions need."""

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""

    def run_task(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run a coroutine; the future is its outcome."""


@dataclass(frozen=True, slots=True)
class _Side:
    """What rclpy's servers and clients of actions differ in."""

    name: str
    handle: str  # the attribute that holds the handle
    announcements: tuple[Announcement, ...]
    ready_flags: tuple[str, ...]  # the attributes that tell ``take_data`` what to look for


_SERVER = _Side(
    "action server",
    "_handle",
    readiness.ACTION_SERVER,
    ("_is_goal_request_ready", "_is_cancel_request_ready", "_is_result_request_ready"),
)
# In this order: once the result is there, rclpy drops the feedback that is still to be taken.
_CLIENT = _Side(
    "action client",
    "_client_handle",
    readiness.ACTION_CLIENT,
    (
        "_is_goal_response_ready",
        "_is_feedback_ready",
        "_is_status_ready",
        "_is_cancel_response_ready",
        "_is_result_response_ready",
    ),
)
#: Where an action client keeps the requests that wait for each kind of response.
_PENDING = {
    "goal": "_pending_goal_requests",
    "cancel": "_pending_cancel_requests",
    "result": "_pending_result_requests",
}
_RETRIES = 20
_RETRY_AFTER_S = 0.001


class ActionSource:
    """Everything one action server or client receives, one thing at a time."""

    def __init__(
        self, waitable: ActionServer | ActionClient, executor: object, loop: TaskLoop
    ) -> None:
        self._waitable: Any = waitable
        self._side = _SERVER if isinstance(waitable, ActionServer) else _CLIENT
        self.passes_over = self._side is _CLIENT
        self._handle: Handle = getattr(waitable, self._side.handle)
        self._executor = executor
        self._loop = loop

    @property
    def name(self) -> str:
        """What it is."""
        return f"{self._side.name} of {self._waitable._action_type.__name__}"

    def attach(self, signal: Signal) -> None:
        """Have everything about the action announced."""
        signal.attach(self._handle, *self._side.announcements)

    def detach(self, signal: Signal) -> None:
        """End that."""
        signal.detach(self._handle)

    def take(self) -> Any:
        """Return one thing the action consists of, by its kind."""
        waitable = self._waitable
        waitable._is_goal_expired = False  # asked for by a timer, see forget_expired_goals
        for wanted in self._side.ready_flags:
            for flag in self._side.ready_flags:
                setattr(waitable, flag, flag == wanted)
            if taken := waitable.take_data():
                return taken
        return None

    def call(self, taken: Any) -> None:
        """Have rclpy work on it."""
        self._work_on(taken, _RETRIES)

    def _work_on(self, taken: Any, retries: int) -> None:
        if retries and self._is_early(taken):
            later = partial(self._work_on, taken, retries - 1)
            self._loop.call_later(_RETRY_AFTER_S, later)
            return
        for future in self._waitable._futures:
            future._set_executor(self._executor)
        self._loop.run_task(self._waitable.execute(taken))

    def _is_early(self, taken: dict[str, Any]) -> bool:
        """Tell whether a response came before its request was noted down.

        rclpy does that after sending, without a lock, and adds the future last: another thread may
        be in between.
        """
        return self._side is _CLIENT and any(
            kind in _PENDING
            and getattr(self._waitable, _PENDING[kind]).get(item[0]) not in self._waitable._futures
            for kind, item in taken.items()
        )


def keeps_goals(server: ActionServer) -> bool:
    """Tell whether the server keeps goals, running or ended."""
    return bool(server._goal_handles)


async def forget_expired_goals(server: ActionServer) -> None:
    """Drop the goals that ended longer ago than the server's result timeout."""
    with server._lock:
        kept = len(server._goal_handles)
        if not kept:  # rcl takes room for no goal as an error
            return
        expired = server._handle.expire_goals(kept)
    await server._execute_expire_goals(expired)


def contain(server: ActionServer, report: Report) -> None:
    """Turn what the server's callbacks raise into an answer to the client, and a report.

    A goal whose acceptance raises is rejected, a cancellation likewise; one whose execution raises
    is aborted. rclpy by itself leaves the client without an answer, or contains ``Exception`` only.
    """

    def reject(_: object) -> GoalResponse:
        return GoalResponse.REJECT

    def refuse(_: object) -> CancelResponse:
        return CancelResponse.REJECT

    def abort(goal: Any) -> Any:
        if goal.is_active:
            goal.abort()
        return server.action_type.Result()

    def give_up(goal: Any) -> None:
        goal.execute(abort)  # the way for a goal that was accepted only

    server.register_goal_callback(_contained(server._goal_callback, reject, report))
    server.register_cancel_callback(_contained(server._cancel_callback, refuse, report))
    server.register_execute_callback(_contained(server._execute_callback, abort, report))
    accepted = _contained(server._handle_accepted_callback, give_up, report)
    server.register_handle_accepted_callback(accepted)


def _contained(
    callback: Callable[[Any], Any], instead: Callable[[Any], Any], report: Report
) -> Callable[[Any], Any]:
    def fail(error: BaseException, argument: Any) -> Any:
        if not isinstance(error, Cancelled):  # the loop stops: nothing to report
            report(name_of(callback), error)
        return instead(argument)

    def call(argument: Any) -> Any:
        try:
            return callback(argument)
        except BaseException as error:
            return fail(error, argument)

    async def call_and_await(argument: Any) -> Any:
        try:
            return await callback(argument)
        except GeneratorExit:
            raise
        except BaseException as error:
            return fail(error, argument)

    return call_and_await if inspect.iscoroutinefunction(callback) else call


async def take_goal(server: Any, goal_id: UUID, goal: Any, tell: Callable[[bool], None]) -> None:
    """Take a goal that did not come by DDS; ``tell`` is told first whether it is accepted.

    As ``ActionServer._execute_goal_request`` does, but for the answer.
    """
    response = server._goal_callback(goal)
    if inspect.isawaitable(response):
        response = await response
    if response is not GoalResponse.ACCEPT:
        tell(False)
        return
    info = GoalInfo(goal_id=goal_id, stamp=server._node.get_clock().now().to_msg())
    with server._lock:
        handle = ServerGoalHandle(server, info, goal)
    identity = bytes(goal_id.uuid)
    server._goal_handles[identity] = handle
    server._result_futures[identity] = RclpyFuture()
    server.add_future(server._result_futures[identity])
    tell(True)
    server._handle.publish_status()
    accepted = server._handle_accepted_callback(handle)
    if inspect.isawaitable(accepted):
        await accepted


async def cancel_goal(server: Any, goal_id: UUID) -> Any:
    """Ask for the end of a goal otherwise than by DDS; return the response, as by DDS."""
    asked = CancelGoal.Request(goal_info=GoalInfo(goal_id=goal_id))
    with server._lock:
        response = server._handle.process_cancel_request(asked, CancelGoal.Response)
    found, response.goals_canceling = response.goals_canceling, []
    for info in found:
        handle = server._goal_handles.get(bytes(info.goal_id.uuid))
        if handle is not None and await _agrees(server, handle):
            response.goals_canceling.append(info)
    return response


async def _agrees(server: Any, handle: ServerGoalHandle) -> bool:
    response = server._cancel_callback(handle)
    if inspect.isawaitable(response):
        response = await response
    if response is not CancelResponse.ACCEPT:
        return False
    try:
        handle._update_state(GoalEvent.CANCEL_GOAL)
    except RCLError:
        return False  # it has ended just now
    return True


def when_ended(server: Any, identity: bytes, tell: Callable[[Any], None]) -> None:
    """Have ``tell`` called with the response to a request for the goal's result, as by DDS."""
    future = server._result_futures.get(identity)
    if future is None:  # ended long ago
        tell(server.action_type.Impl.GetResultService.Response())
    else:
        future.add_done_callback(lambda done: tell(done.result()))
