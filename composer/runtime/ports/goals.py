"""How goals are executed: in a running system, and in tests of behaviors, which need no ROS."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, Generic, Protocol, TypeVar

from composer.base.fast_dataclass import dataclass
from composer.behavior import CallCancelled, Goal
from composer.model import Port
from composer.runtime.callbacks.user_code import UserCode, queue_for
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.tasks import wait_for
from composer.runtime.executors.tracebacks import calls_user_code, is_closing, shown, text_of
from composer.runtime.ports import RunningPort

#: Maximum time for handlers to end their goals once the node leaves *active*.
CANCEL_LIMIT_S = 1.0


class ServedGoal(Goal[Any, Any], Protocol):
    """A goal, as its server sees it."""

    has_begun: bool  # before its task, which another thread may run at once
    task: Future[Any] | None
    ended: Future[None]

    @property
    def is_open(self) -> bool:
        """Whether the goal has not succeeded, aborted or been canceled yet."""

    def execute(self) -> None:
        """Set the status to executing, unless the goal is being canceled."""

    def request_cancel(self) -> None:
        """Notify the handler that the node is leaving the active state."""


G = TypeVar("G", bound=ServedGoal)


@dataclass(frozen=True, slots=True)
class Handlers:
    """A behavior's handlers of an action server: ``on_<port>`` and ``accept_<port>``."""

    execute: Callable[[Any], Any] | None = None
    accept: Callable[[Any], Any] | None = None


@dataclass(frozen=True, slots=True)
class GoalOutcome:
    """How a goal ended; see :class:`composer.behavior.GoalResult`."""

    status: str
    result: Any


class GoalExecutor(RunningPort, Generic[G]):
    """Executes goals while the node is active, one at a time unless the port is reentrant.

    Waiting goals are accepted and can be canceled. Goals beyond the depth of the port's QoS are
    rejected.
    """

    def __init__(self, context: UserCode, port: Port, action_type: Any, handlers: Handlers) -> None:
        self._context = context
        self._name = port.name.value
        self._callback = f"action server '{self._name}'"
        self._type = action_type
        self._handlers = handlers
        self._accepts = port.accept.value.holds if port.accept is not None else None
        self._goals: dict[G, bool] = {}  # each of them true: popping is atomic
        self._limit = None if port.reentrant else port.qos.profile.queue_depth
        self._queue = queue_for(context, self._run, None, depth=None, reentrant=port.reentrant)

    @abstractmethod
    def _send_result(self, goal: G, result: Any) -> None:
        """Send the result of a goal that has ended."""

    def deactivate(self) -> None:
        """Cancel the waiting goals and request cancellation of the running ones."""
        for goal in self._queue.clear():
            self._end(goal, None, canceled=True)
        for goal in tuple(self._goals):
            goal.request_cancel()

    async def drain(self) -> None:
        """Wait until the handlers have ended their goals; after a time limit, cancel them."""
        for goal in tuple(self._goals):
            if not await wait_for(self._context.loop, goal.ended, CANCEL_LIMIT_S):
                self._context.log.warn(
                    f"{self._callback}: a goal did not end within {CANCEL_LIMIT_S:g} s, canceled"
                )
                self._force_cancel(goal)

    def destroy(self) -> None:
        """Cancel the remaining goals."""
        for goal in tuple(self._goals):
            self._force_cancel(goal)

    async def _is_accepted(self, request: Any) -> bool:
        """Return whether a goal is accepted; log why it is not."""
        try:
            reason = await self._rejection(request)
        except BaseException as error:
            self._context.on_exception(f"accept_{self._name}", error)
            return False
        if reason is not None:
            self._context.log.info(f"{self._callback} rejects a goal: {reason}")
        return reason is None

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

    def _start(self, goal: G) -> None:
        """Execute an accepted goal, now or after the previous ones."""
        self._context.statistics.calls += 1
        self._goals[goal] = True
        self._queue.put(goal)

    # --- execution

    def _run(self, goal: G) -> Coroutine[Any, Any, None] | None:
        if not goal.is_open:
            return None  # canceled while it waited
        goal.has_begun = True
        goal.execute()
        steps = self._steps(goal)
        goal.task = self._context.spawn(self._context.strand.wrap(steps))
        return self._follow(goal, goal.task)

    async def _follow(self, goal: G, task: Future[Any]) -> None:
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

    def _steps(self, goal: G) -> Coroutine[Any, Any, Any]:
        """Return a coroutine that executes a goal and returns its result."""
        return self._execute(goal)

    @calls_user_code
    async def _execute(self, goal: G) -> Any:
        if self._handlers.execute is None:
            return None
        result = self._handlers.execute(goal)
        return await result if isinstance(result, Awaitable) else result

    def _finish(self, goal: G, result: Any) -> None:
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
        if result is None or issubclass(type(result), self._type.Result):
            return ""
        return f"returned {shown(result)}, not a {self._type.__name__}.Result"

    def _force_cancel(self, goal: G) -> None:
        self._end(goal, None, canceled=True)
        if goal.task is not None:
            goal.task.cancel()

    def _end(self, goal: G, result: Any, *, canceled: bool) -> None:
        """Cancel or abort a goal that is still open, and send its result, once."""
        if not self._goals.pop(goal, False):
            return
        if goal.is_open:
            if canceled:
                goal.canceled()
            else:
                goal.abort()
        self._send_result(goal, self._type.Result() if result is None else result)
        goal.ended.set_result(None)
