"""The source of action servers and clients, which runs rclpy's own code as its executors do.

Together with ``sources`` and ``readiness``, everything that uses rclpy's internals.
"""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

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

from composer.base.fast_dataclass import dataclass
from composer.runtime.clock import Clock
from composer.runtime.executors import readiness
from composer.runtime.executors.base_loop import BaseLoop
from composer.runtime.executors.readiness import EntitySource, SetCallback

#: The attributes of an action client with the requests that wait for each kind of response.
_PENDING = {
    "goal": "_pending_goal_requests",
    "cancel": "_pending_cancel_requests",
    "result": "_pending_result_requests",
}
#: An early response is tried again after a millisecond, then after twice as long each time: on a
#: busy machine, the thread that registers its request may not run for a while.
_RETRY_AFTER_S = 0.001
LAST_RETRY_AFTER_S = 2.0
#: Ended goals whose status rcl keeps publishing, so that late subscribers see it.
KEPT_STATUSES = 10
#: Results that are kept for clients of other processes, and for how long, as by rclpy.
KEPT_RESULTS = 1000
RESULT_TIMEOUT_S = 900.0


@dataclass(frozen=True, slots=True)
class _Role:
    """How rclpy's action servers and action clients differ."""

    name: str
    handle: str  # the attribute that holds the handle
    setters: tuple[SetCallback, ...]
    ready_flags: tuple[str, ...]  # the attributes that select what ``take_data`` takes
    unused_flag: str  # selects what is never taken


_SERVER = _Role(
    "action server",
    "_handle",
    readiness.ACTION_SERVER,
    ("_is_goal_request_ready", "_is_cancel_request_ready", "_is_result_request_ready"),
    "_is_goal_expired",
)
# In this order: after taking the result, rclpy drops feedback that was not taken. The statuses of
# goals stay in the reader: converting all of them takes longer than a goal, and ports do not use
# them.
_CLIENT = _Role(
    "action client",
    "_client_handle",
    readiness.ACTION_CLIENT,
    (
        "_is_goal_response_ready",
        "_is_feedback_ready",
        "_is_cancel_response_ready",
        "_is_result_response_ready",
    ),
    "_is_status_ready",
)


class ActionSource(EntitySource):
    """Everything that an action server or client receives, one item at a time."""

    def __init__(
        self, waitable: ActionServer | ActionClient, executor: object, loop: BaseLoop
    ) -> None:
        self._waitable: Any = waitable
        self._role = _SERVER if isinstance(waitable, ActionServer) else _CLIENT
        setattr(waitable, self._role.unused_flag, False)
        self.may_skip = self._role is _CLIENT
        super().__init__(getattr(waitable, self._role.handle), *self._role.setters)
        self._executor = executor
        self._loop = loop

    @property
    def name(self) -> str:
        """The role and the action type."""
        return f"{self._role.name} of {self._waitable._action_type.__name__}"

    def take(self) -> Any:
        """Return one item, by its kind."""
        waitable = self._waitable
        for selected in self._role.ready_flags:
            for flag in self._role.ready_flags:
                setattr(waitable, flag, flag == selected)
            if taken := waitable.take_data():
                return taken
        return None

    def call(self, taken: Any) -> None:
        """Pass the item to rclpy."""
        self._execute(taken, _RETRY_AFTER_S)

    def _execute(self, taken: Any, retry_after_s: float) -> None:
        if retry_after_s < LAST_RETRY_AFTER_S and self._is_early(taken):
            later = partial(self._execute, taken, 2 * retry_after_s)
            self._loop.call_later(retry_after_s, later)
            return
        for future in tuple(self._waitable._futures):  # other threads add to it
            future._set_executor(self._executor)
        self._loop.run_task(self._waitable.execute(taken))

    def _is_early(self, taken: dict[str, Any]) -> bool:
        """Return whether a response arrived before its request was registered.

        rclpy registers a request after sending it, without a lock, and adds the future last:
        another thread may run in between.
        """
        return self._role is _CLIENT and any(
            kind in _PENDING
            and getattr(self._waitable, _PENDING[kind]).get(item[0]) not in self._waitable._futures
            for kind, item in taken.items()
        )


async def execute_goal_request(
    server: Any, goal_id: UUID, goal: Any, respond: Callable[[bool], None]
) -> None:
    """Handle a goal request that did not come by DDS.

    First calls ``respond`` with whether the goal is accepted. Otherwise as
    ``ActionServer._execute_goal_request``.
    """
    response = server._goal_callback(goal)
    if inspect.isawaitable(response):
        response = await response
    if response is not GoalResponse.ACCEPT:
        respond(False)
        return
    info = GoalInfo(goal_id=goal_id, stamp=server._node.get_clock().now().to_msg())
    with server._lock:
        handle = ServerGoalHandle(server, info, goal)
    identity = bytes(goal_id.uuid)
    server._goal_handles[identity] = handle
    server._result_futures[identity] = RclpyFuture()
    server.add_future(server._result_futures[identity])
    respond(True)
    server._handle.publish_status()
    accepted = server._handle_accepted_callback(handle)
    if inspect.isawaitable(accepted):
        await accepted


async def execute_cancel_request(server: Any, goal_id: UUID) -> Any:
    """Handle a cancel request that did not come by DDS; return the response."""
    request = CancelGoal.Request(goal_info=GoalInfo(goal_id=goal_id))
    with server._lock:
        response = server._handle.process_cancel_request(request, CancelGoal.Response)
    requested, response.goals_canceling = response.goals_canceling, []
    for info in requested:
        handle = server._goal_handles.get(bytes(info.goal_id.uuid))
        if handle is not None and await _accepts_cancel(server, handle):
            response.goals_canceling.append(info)
    return response


async def _accepts_cancel(server: Any, handle: ServerGoalHandle) -> bool:
    response = server._cancel_callback(handle)
    if inspect.isawaitable(response):
        response = await response
    if response is not CancelResponse.ACCEPT:
        return False
    try:
        handle._update_state(GoalEvent.CANCEL_GOAL)
    except RCLError:
        return False  # it has just ended
    return True


def add_result_callback(server: Any, identity: bytes, respond: Callable[[Any], None]) -> None:
    """Call ``respond`` with the result response of a goal once it has ended, as by DDS."""
    future = server._result_futures.get(identity)
    if future is None:  # expired
        respond(server.action_type.Impl.GetResultService.Response())
    else:
        future.add_done_callback(lambda done: respond(done.result()))


class GoalServer(ActionServer):
    """rclpy's action server, with limits for what it keeps of ended goals.

    At each transition rcl publishes the status of all goals that it keeps, and clients turn the
    array into Python objects. With rclpy's result timeout of 15 minutes, goals take longer and
    longer. Here rcl keeps few ended goals, and results are kept apart from their statuses.
    """

    def __init__(self, *arguments: Any, clock: Clock, **options: Any) -> None:
        """Create the server; the others are rclpy's arguments, without ``result_timeout``."""
        # Zero: rcl discards ended goals on request.
        super().__init__(*arguments, result_timeout=0, **options)
        self._monotonic = clock.monotonic
        self._changing = threading.Lock()
        #: The ended goals that rcl keeps, and whether their result was delivered.
        self._ended: dict[bytes, bool] = {}
        #: The other ended goals, and when they ended.
        self._results: dict[bytes, float] = {}

    def end(self, identity: bytes, response: Any) -> None:
        """Send the result response of a goal that has succeeded, or was canceled or aborted."""
        with self._changing:
            self._ended[identity] = False
        future = self._result_futures[identity]
        future.set_result(response)
        super().remove_future(future)
        with self._changing:
            excess = len(self._ended) - KEPT_STATUSES
            if excess > 0:
                with self._lock:
                    expired = self._handle.expire_goals(excess)
                self._on_expired(expired)
            self._discard_old_results()

    def discard_result(self, identity: bytes) -> None:
        """Do not keep the result of an ended goal: the only client that may ask has it."""
        with self._changing:
            if identity in self._ended:
                self._ended[identity] = True
            elif self._results.pop(identity, None) is not None:
                self._discard(identity)

    def remove_future(self, future: Any) -> None:
        """Remove the future of a goal that has not ended: executors visit all futures."""
        if not future.done():
            super().remove_future(future)

    def _on_expired(self, infos: Iterable[Any]) -> None:
        for info in infos:
            identity = bytes(info.goal_id.uuid)
            if self._ended.pop(identity, False):
                self._discard(identity)
            else:
                self._results[identity] = self._monotonic()

    def _discard_old_results(self) -> None:
        oldest_s = self._monotonic() - RESULT_TIMEOUT_S
        for identity, ended_s in tuple(self._results.items()):
            if ended_s > oldest_s and len(self._results) <= KEPT_RESULTS:
                break
            del self._results[identity]
            self._discard(identity)

    def _discard(self, identity: bytes) -> None:
        # Only now: as long as rcl keeps a goal, it uses the memory of the handle.
        self._goal_handles.pop(identity).destroy()
        del self._result_futures[identity]
