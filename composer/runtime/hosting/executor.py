"""``self.executor`` of a hosted class: its tasks are code of the class, as its callbacks are."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from typing import TYPE_CHECKING, Any

from rclpy.task import Future as RclpyFuture

from composer.runtime.executors.futures import Awaited
from composer.runtime.executors.loop import NodeExecutor
from composer.runtime.executors.tasks import name_of
from composer.runtime.executors.tracebacks import calls_user_code
from composer.runtime.hosting.user_code import UserFunction

if TYPE_CHECKING:
    from composer.runtime.hosting.instance import Instance

#: Packages that create tasks for their own functions. These call code of the class as such.
_OTHERS = frozenset({"composer", "rclpy"})


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
