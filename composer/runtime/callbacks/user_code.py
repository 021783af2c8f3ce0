"""Runs the user code of a node on its loop: exceptions are faults, coroutines are tasks.

What arrives at a port waits in a queue, which handles one item at a time. If it is full, the oldest
item is dropped.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from composer.behavior import CallCancelled, Logger
from composer.runtime.executors.base_loop import BaseLoop
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.strand import InlineStrand, OuterCoroutine, Strand, Work
from composer.runtime.executors.tracebacks import calls_user_code, is_closing, text_of
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate
from composer.runtime.metrics.statistics import Statistics

if TYPE_CHECKING:
    from composer.runtime.callbacks.callback import CallbackTimer


T = TypeVar("T")


class Faults(Protocol):
    """Receives what user code raises."""

    def exception(self, callback: str, error: BaseException) -> None:
        """Receive an exception of ``callback``."""

    def error(self, callback: str, text: str) -> None:
        """Receive another error of ``callback``, such as a wrong result."""


class UserCode:
    """Calls user code and runs its coroutines. A base class; the attributes are a subclass's."""

    __slots__ = ()

    loop: BaseLoop
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


def queue_for(
    context: UserCode,
    work: Work[T],
    timer: CallbackTimer | None,
    *,
    depth: int | None,
    reentrant: bool,
) -> CallbackQueue[T]:
    """Return the queue of a port for ``work``, which ``timer`` times.

    ``depth`` is how many items may wait; None is unlimited. With ``reentrant`` no item waits:
    each is worked on at once.
    """
    if reentrant:
        return ReentrantQueue(context, work, timer, depth)
    if isinstance(context.strand, InlineStrand):
        return SingleThreadQueue(context, work, timer, depth)
    return CallbackQueue(context, work, timer, depth)


class CallbackQueue(Generic[T]):
    """Items that wait for ``work``, on several threads."""

    __slots__ = ("_busy", "_context", "_depth", "_lock", "_waiting", "_work")

    def __init__(
        self, context: UserCode, work: Work[T], timer: CallbackTimer | None, depth: int | None
    ) -> None:
        self._context = context
        self._work = work if timer is None else timer.wrap(work)
        self._depth = depth
        self._waiting: deque[T] = deque()
        self._busy = False
        self._lock = threading.Lock()

    def put(self, item: T) -> T | None:
        """Add ``item``; return the item that was dropped for it, if any."""
        dropped = None
        with self._lock:
            if self._busy and self._depth is not None and len(self._waiting) >= self._depth:
                if self._depth == 0:
                    return item
                dropped = self._waiting.popleft()
            self._waiting.append(item)
            if self._busy:
                return dropped
            self._busy = True
        self._context.strand.post(self._run)
        return None

    def clear(self) -> list[T]:
        """Remove and return all waiting items."""
        with self._lock:
            removed = list(self._waiting)
            self._waiting.clear()
        return removed

    def _run(self) -> None:
        """Work on the first item; the others follow, each with a turn of the strand."""
        if self._work_on_first():
            self._context.strand.post(self._run)

    def _work_on_first(self) -> bool:
        """Work on the first item, if any; return whether the next one can follow."""
        with self._lock:
            if not self._waiting:
                self._busy = False
                return False
            item = self._waiting.popleft()
        coroutine = self._work(item)
        if coroutine is not None:
            self._spawn(coroutine)
            return False
        return self._goes_on()

    def _goes_on(self) -> bool:
        with self._lock:
            self._busy = bool(self._waiting)
            return self._busy

    def _spawn(self, coroutine: Coroutine[Any, Any, None]) -> None:
        task = self._context.spawn(self._context.strand.wrap(coroutine))
        task.add_done_callback(self._next)

    def _next(self, _: object) -> None:
        if self._goes_on():
            self._context.strand.post(self._run)


class SingleThreadQueue(CallbackQueue[T]):
    """The queue of a port whose loop has one thread: nothing is locked."""

    __slots__ = ()

    def put(self, item: T) -> T | None:
        """Add ``item``; return the item that was dropped for it, if any."""
        if self._busy:
            return super().put(item)
        self._busy = True
        coroutine = self._work(item)
        if coroutine is not None:
            self._spawn(coroutine)
        elif self._waiting:
            self._run()
        else:
            self._busy = False
        return None

    def _run(self) -> None:
        """Work on the waiting items until one has to be awaited or none is left."""
        while self._work_on_first():
            pass


class ReentrantQueue(CallbackQueue[T]):
    """The queue of a reentrant port: no item waits."""

    __slots__ = ()

    def put(self, item: T) -> None:
        """Work on ``item`` at once."""
        self._context.loop.overlap()
        coroutine = self._work(item)
        if coroutine is not None:
            self._context.spawn(coroutine)
