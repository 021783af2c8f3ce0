"""Runs the user code of a node on its loop: exceptions are faults, coroutines are tasks."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, Protocol, TypeVar

from composer.behavior import CallCancelled, Logger
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.strand import OuterCoroutine, Strand
from composer.runtime.executors.tasks import SupportsCallLater
from composer.runtime.executors.tracebacks import calls_user_code, is_closing, text_of
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate
from composer.runtime.metrics.statistics import Statistics

T = TypeVar("T")


class TaskLoop(SupportsCallLater, Protocol):
    """The part of a loop that user code needs."""

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` as soon as the loop is free."""

    def overlap(self) -> None:
        """Let other threads serve the loop while a callback runs, if it is parallel."""

    def run_task(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run a coroutine; return the future of its result."""


class Faults(Protocol):
    """Receives what user code raises."""

    def exception(self, callback: str, error: BaseException) -> None:
        """Receive an exception of ``callback``."""

    def error(self, callback: str, text: str) -> None:
        """Receive another error of ``callback``, such as a wrong result."""


class UserCode:
    """Calls user code and runs its coroutines. A base class; the attributes are a subclass's."""

    __slots__ = ()

    loop: TaskLoop
    gate: LifecycleGate
    strand: Strand
    log: Logger
    error_log: Faults
    statistics: Statistics
    names: dict[str, Any]
    tasks: set[Future[Any]]

    def spawn(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run ``coroutine`` on the node's loop, at most as long as the node's entities exist."""
        task = self.loop.run_task(coroutine)
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)
        return task

    def cancel_tasks(self) -> None:
        """Cancel every coroutine of the node's ports."""
        for task in tuple(self.tasks):
            task.cancel()

    @calls_user_code
    def call(
        self, name: str, function: Callable[..., Any], *arguments: Any
    ) -> Coroutine[Any, Any, None] | None:
        """Call user code and ignore its result; its exceptions are faults of ``name``.

        Returns the rest of the call if it is ``async``.
        """
        try:
            result = function(*arguments)
            return None if result is None else self.continuation(name, result)
        except BaseException as error:
            self.error_log.exception(name, error)
            return None

    def continuation(self, name: str, result: object) -> Coroutine[Any, Any, None] | None:
        """Return a coroutine that awaits a result of user code, or None if it is not awaitable."""
        if isinstance(result, Coroutine):
            return OuterCoroutine(self._continue(name, result), result)
        return self._continue(name, result) if isinstance(result, Awaitable) else None

    @calls_user_code
    async def _continue(self, name: str, result: Awaitable[Any]) -> None:
        try:
            await result
        except BaseException as error:
            self.on_exception(name, error)

    def on_exception(self, name: str, error: BaseException) -> None:
        """Record an exception of awaited user code as a fault of ``name``.

        Call it where the exception was caught. Raises it again if it ends the coroutine. A call or
        sleep that was canceled because the node left *active* is not a fault.
        """
        kind = type(error)  # ``__class__`` may be a property of the user
        if issubclass(kind, Cancelled) or is_closing(error):
            raise error
        if issubclass(kind, CallCancelled) and not self.gate.incoming:
            self.log.debug(f"{name}: {text_of(error)}")
        else:
            self.error_log.exception(name, error)
