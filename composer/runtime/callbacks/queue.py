"""The queue of a port: one item is handled at a time; if it is full, the oldest is dropped."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from composer.runtime.callbacks.user_code import UserCode
from composer.runtime.executors.strand import InlineStrand, Work

if TYPE_CHECKING:
    from composer.runtime.callbacks.callback import CallbackTimer

T = TypeVar("T")


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
