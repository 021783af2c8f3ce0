"""Calls the code of hosted classes, so that it is known which node's code a thread runs.

The tasks of a class, which it creates with ``self.executor``, are code of the class as well.
"""

from __future__ import annotations

import inspect
import threading
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING, Any, cast

from rclpy.callback_groups import CallbackGroup
from rclpy.task import Future as RclpyFuture

from composer.behavior import CallCancelled
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.futures import Awaited, Cancelled, Future
from composer.runtime.executors.loop import NodeExecutor
from composer.runtime.executors.strand import in_steps, scope_of
from composer.runtime.executors.tasks import name_of, sleep
from composer.runtime.executors.tracebacks import (
    calls_user_code,
    gc_paused,
    location_of,
    stacks_of,
)
from composer.runtime.node.interruption import RunningCallback, running_callbacks

if TYPE_CHECKING:
    from composer.runtime.hosting.instance import Instance

_STARTED_BY = "_composer_code"
#: How often a group that has refused a callback is asked again. rclpy asks at each wake-up.
_ASK_AGAIN_S = 0.01
_PERIOD_S = 0.02
#: How long a callback may go on when its node is cleaned up.
_RETURN_WITHIN_S = 0.2
#: Packages that create tasks for their own functions. These call code of the class as such.
_OTHERS = frozenset({"composer", "rclpy"})
#: Another thread must not begin a callback between the two questions about one.
_ASKING = threading.Lock()


class _Current(threading.local):
    instance: Instance | None = None


_CURRENT = _Current()


def current_instance() -> Instance | None:
    """Return the instance whose code the calling thread runs, or None.

    Threads that an instance has started run its code.
    """
    return _CURRENT.instance or getattr(threading.current_thread(), _STARTED_BY, None)


def on_thread_start(thread: threading.Thread) -> None:
    """Remember whose code has started a thread, if any."""
    instance = current_instance()
    if instance is not None:
        instance.threads.append(thread)
        setattr(thread, _STARTED_BY, instance)


class UserFunction:
    """A function of a hosted class; plain, or a coroutine function if ``is_async``.

    SystemExit means that the class has finished: the node is deactivated.
    """

    def __init__(self, instance: Instance, function: Callable[..., Any]) -> None:
        self._context = instance.context  # by which a call on a stack is recognized
        self.instance = instance
        self.is_async = inspect.iscoroutinefunction(function)
        #: Whether the last call, or the last step of a coroutine, has blocked.
        self.blocks = False
        self.__name__ = getattr(function, "__name__", type(function).__name__)
        self.__qualname__ = getattr(function, "__qualname__", self.__name__)
        self._function = instance.instrumented(self.__name__, function)

    @calls_user_code
    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the function. Raises what it raises."""
        before, _CURRENT.instance = _CURRENT.instance, self.instance
        began = self.instance.begin_blocking(expected=self.blocks)
        try:
            result = self._function(*arguments, **options)
        except SystemExit:
            self.instance.settings.finish("it raised SystemExit")
            return None
        except CallCancelled as error:  # it waited for a response when the node left *active*
            if self._context.gate.incoming:
                raise
            self._context.log.debug(f"{self.__name__}: {error}")
            return None
        finally:
            self.blocks = self.instance.end_blocking(began)
            _CURRENT.instance = before
            if self.instance.spun is not None:
                self.instance.spun.set_result(None)
        return in_steps(_Steps(self), result) if inspect.iscoroutine(result) else result

    def is_one(self, instance: Instance, function: UserFunction | None) -> bool:
        """Return whether this is ``function``; without it, any one of ``instance``."""
        return self.instance is instance and function in (None, self)


class PermittedFunction(UserFunction):
    """A callback of an entity in a group of the class's own type, which decides when it runs.

    The group is asked before each call, as by rclpy's executors, and learns of its end. Callbacks
    of one entity run one at a time, because each is a coroutine.
    """

    def __init__(
        self,
        instance: Instance,
        function: Any,
        context: NodeContext,
        group: CallbackGroup,
        entity: Any,
    ) -> None:
        super().__init__(instance, function)
        self.is_async = True
        self._gate = context.gate
        self._entity = entity
        self._can_execute = UserFunction(instance, group.can_execute)
        self._begin = UserFunction(instance, group.beginning_execution)
        self._end = UserFunction(instance, group.ending_execution)

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Return a coroutine that calls the function. It raises what the function raises."""
        return self._call_permitted(arguments, options)

    async def _call_permitted(self, arguments: tuple[Any, ...], options: dict[str, Any]) -> Any:
        while not self._is_permitted():
            await sleep(self._context.loop, _ASK_AGAIN_S)
            if not self._gate.incoming:
                raise CallCancelled(self._gate.refusal)
        try:
            result = super().__call__(*arguments, **options)
            return await result if isinstance(result, Awaitable) else result
        finally:
            self._end(self._entity)

    def _is_permitted(self) -> bool:
        with _ASKING:
            return bool(self._can_execute(self._entity) and self._begin(self._entity))


def call_in_group(context: NodeContext, function: Callable[..., Any], *arguments: Any) -> None:
    """Call ``function`` of a class as its callback group permits, if the node is active then."""

    def call() -> None:
        if context.gate.incoming:
            rest = context.call(function.__name__, function, *arguments)
            if rest is not None:
                context.spawn(context.strand.wrap(rest))

    context.strand.post(call)


class _Steps:
    """Sets the code that runs for each step of a coroutine."""

    __slots__ = ("_before", "_began", "function")

    def __init__(self, function: UserFunction) -> None:
        self.function = function
        self._before: Instance | None = None
        self._began: list[bool] | float | None = None

    def enter(self) -> None:
        """Begin a step, at once."""
        self._before, _CURRENT.instance = _CURRENT.instance, self.function.instance
        self._began = self.function.instance.begin_blocking(expected=self.function.blocks)

    def leave(self) -> None:
        """End a step."""
        self.function.blocks = self.function.instance.end_blocking(self._began)
        _CURRENT.instance = self._before


class CallAbandoned(Cancelled):
    """Raised in code of a class whose time is over. It is not a fault of the class."""


async def end_callbacks(instance: Instance) -> None:
    """Wait a moment for the callbacks of an instance to return, then interrupt those that run."""
    loop = instance.context.loop
    until_s = loop.clock.monotonic() + _RETURN_WITHIN_S
    while any(_running(instance)) and loop.clock.monotonic() < until_s:
        await sleep(loop, _PERIOD_S)
    interrupt_callbacks(instance)


def interrupt_callbacks(instance: Instance, function: UserFunction | None = None) -> None:
    """Interrupt the callbacks of an instance that have not returned, or one, and report each."""
    for callback, name in _running(instance, function):
        at = callback.location()
        callback.interrupt(CallAbandoned)
        if (callback.thread, name) not in instance.interrupted:
            instance.interrupted.add((callback.thread, name))
            where = f"; it is at {at}" if at else ""
            instance.context.log.warn(f"{name} is interrupted{where}")


def _running(
    instance: Instance, function: UserFunction | None = None
) -> Iterator[tuple[RunningCallback, str]]:
    """Yield the callbacks that other threads run, one for each thread, and their names."""
    threads = set(instance.context.loop.busy_threads()) - {threading.get_ident()}
    for callbacks in running_callbacks(threads):
        for callback in callbacks:
            with gc_paused():
                item = next(filter(None, map(_function_of, callback.callers)), None)
            if item is not None and item.is_one(instance, function):
                yield callback, item.__name__
                break


def _function_of(frame: FrameType) -> UserFunction | None:
    """Return the function of a class that a frame calls, or a coroutine of which it runs."""
    if frame.f_code is UserFunction.__call__.__code__:
        return cast("UserFunction", frame.f_locals["self"])
    scope = scope_of(frame)
    return scope.function if isinstance(scope, _Steps) else None


class ThreadedCall:
    """A call of user code that may block, on a thread of its own: the loop goes on."""

    def __init__(self, instance: Instance, function: Callable[[], Any], name: str) -> None:
        self._instance = instance
        self._function = function
        self._done: Future[Any] = Future()
        #: Where it was when its time was over: ``file:line``, in code of the user.
        self.location = ""
        #: The thread of the call.
        self.thread = threading.Thread(target=self._run, name=name, daemon=True)

    async def result(self) -> Any:
        """Make the call and return its result. Raises what it raises.

        If the caller is canceled, the call is interrupted as soon as it runs code of the user.
        """
        self._instance.context.loop.clock.start(self.thread)
        try:
            return await self._done
        except Cancelled:
            self.location = self.find_location()
            for callbacks in running_callbacks((self.thread.ident or 0,)):
                callbacks[0].interrupt(CallAbandoned)
            raise

    def find_location(self) -> str:
        """Return the ``file:line`` where it is now, in code of the user."""
        ident = self.thread.ident or 0
        return location_of(stacks_of((ident,)).get(ident, ()))

    @calls_user_code
    def _run(self) -> None:
        _CURRENT.instance = self._instance
        try:
            self._done.set_result(self._function())
        except BaseException as error:
            self._done.set_exception(error)


class InstanceExecutor(NodeExecutor):
    """The part of ``rclpy.executors.Executor`` that classes use.

    While a task blocks, others run. It is reported and interrupted as a callback is.
    """

    def __init__(self, instance: Instance) -> None:
        super().__init__(instance.context.loop)
        self._instance = instance
        self._context = instance.context  # by which a task on a stack is recognized

    def create_task(
        self,
        callback: Callable[..., Any] | Coroutine[Any, Any, Any],
        *arguments: Any,
        **options: Any,
    ) -> RclpyFuture:
        """Run a function, plain or ``async def``, or a coroutine; return the future of its result.

        An exception is one of the future, and an error of the node.
        """
        if isinstance(callback, Coroutine):
            function = UserFunction(self._instance, lambda: callback)
        elif str(getattr(callback, "__module__", None)).partition(".")[0] in _OTHERS:
            return super().create_task(callback, *arguments, **options)
        else:
            function = UserFunction(self._instance, partial(callback, *arguments, **options))
        function.__name__ = name_of(callback).rpartition(".")[2]
        outcome = RclpyFuture(executor=self)
        self._context.spawn(self._run(function, outcome))
        return outcome

    @calls_user_code
    async def _run(self, function: UserFunction, outcome: RclpyFuture) -> None:
        try:
            result = function()
            outcome.set_result(await result if isinstance(result, Coroutine) else result)
        except BaseException as error:
            fail(outcome, error)
            self._context.on_exception(function.__name__, error)

    def spin_until_future_complete(self, future: Awaited, timeout_sec: float | None = None) -> None:
        """Wait for a future, or for a time."""
        self._instance.spin(future, timeout_sec)

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait until a callback has ended, or for a time."""
        self._instance.spin_once(timeout_sec)


def fail(future: RclpyFuture, error: BaseException) -> None:
    """Fail a future. rclpy prints exceptions that are never retrieved, but not this one."""
    future.set_exception(error)
    future.exception()
