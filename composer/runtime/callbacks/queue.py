"""The waiting line of a port: one run of its handler at a time, the oldest makes room."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Coroutine
from typing import Any, Generic, TypeVar

from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.timing import CallbackTimer
from composer.runtime.executors.strand import InlineStrand, Work

T = TypeVar("T")


def line_for(
    core: NodeContext,
    work: Work[T],
    timer: CallbackTimer | None,
    *,
    depth: int | None,
    reentrant: bool,
) -> Line[T]:
    """Return the line of a port of ``core``, for ``work`` that ``timer`` takes the times of.

    ``depth`` is how many may wait; None means any number. With ``reentrant`` nothing waits: every
    item is worked on at once.
    """
    if reentrant:
        return OverlappingLine(core, work, timer, depth)
    if isinstance(core.strand, InlineStrand):
        return OneThreadLine(core, work, timer, depth)
    return Line(core, work, timer, depth)


class Line(Generic[T]):
    """Items that wait for ``work``, on several threads."""

    __slots__ = ("_busy", "_core", "_depth", "_lock", "_waiting", "_work")

    def __init__(
        self, core: NodeContext, work: Work[T], timer: CallbackTimer | None, depth: int | None
    ) -> None:
        self._core = core
        self._work = work if timer is None else timer.around(work)
        self._depth = depth
        self._waiting: deque[T] = deque()
        self._busy = False
        self._lock = threading.Lock()

    def put(self, item: T) -> T | None:
        """Take ``item`` in; return the one that had to make room for it, if any."""
        pushed_out = None
        with self._lock:
            if self._busy and self._depth is not None and len(self._waiting) >= self._depth:
                if self._depth == 0:
                    return item
                pushed_out = self._waiting.popleft()
            self._waiting.append(item)
            if self._busy:
                return pushed_out
            self._busy = True
        self._core.strand.post(self._run)
        return None

    def clear(self) -> list[T]:
        """Take out everything that waits and return it."""
        with self._lock:
            left = list(self._waiting)
            self._waiting.clear()
        return left

    def _run(self) -> None:
        """Work on what waits until something has to be awaited or nothing is left."""
        while True:
            with self._lock:
                if not self._waiting:
                    self._busy = False
                    return
                item = self._waiting.popleft()
            coroutine = self._work(item)
            if coroutine is not None:
                self._spawn(coroutine)
                return

    def _spawn(self, coroutine: Coroutine[Any, Any, None]) -> None:
        task = self._core.spawn(self._core.strand.wrap(coroutine))
        task.add_done_callback(self._next)

    def _next(self, _: object) -> None:
        self._core.strand.post(self._run)


class OneThreadLine(Line[T]):
    """The line of a port whose loop has one thread: nothing has to be locked."""

    __slots__ = ()

    def put(self, item: T) -> T | None:
        """Take ``item`` in; return the one that had to make room for it, if any."""
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


class OverlappingLine(Line[T]):
    """The line of a reentrant port: nobody waits in it."""

    __slots__ = ()

    def put(self, item: T) -> None:
        """Work on ``item`` at once."""
        coroutine = self._work(item)
        if coroutine is not None:
            self._core.spawn(coroutine)
