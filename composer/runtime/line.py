"""The waiting line of a port: one run of its handler at a time, the oldest makes room."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any, Generic, TypeVar

from composer.runtime.core import Core
from composer.runtime.strand import Direct

T = TypeVar("T")

#: Does the work for one item; what it returns, if anything, is awaited. Must not raise.
Work = Callable[[T], "Coroutine[Any, Any, None] | None"]


class Line(Generic[T]):
    """Items that wait for ``work``. ``depth`` is how many may wait; None means any number.

    With ``reentrant`` nothing waits: every item is worked on at once.
    """

    __slots__ = ("_busy", "_core", "_depth", "_lock", "_put", "_waiting", "_work")

    def __init__(self, core: Core, work: Work[T], *, depth: int | None, reentrant: bool) -> None:
        self._core = core
        self._work = work
        self._depth = depth
        self._waiting: deque[T] = deque()
        self._busy = False
        self._lock = threading.Lock()
        self._put = self._wait_or_run
        if reentrant:
            self._put = self._overlap
        elif isinstance(core.strand, Direct):
            self._put = self._wait_or_run_now

    def put(self, item: T) -> T | None:
        """Take ``item`` in; return the one that had to make room for it, if any."""
        return self._put(item)

    def clear(self) -> list[T]:
        """Take out everything that waits and return it."""
        with self._lock:
            left = list(self._waiting)
            self._waiting.clear()
        return left

    def _overlap(self, item: T) -> None:
        coroutine = self._work(item)
        if coroutine is not None:
            self._core.spawn(coroutine)

    def _wait_or_run(self, item: T) -> T | None:
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

    def _wait_or_run_now(self, item: T) -> T | None:
        """Do the same on the one thread there is: nothing has to be locked."""
        if self._busy:
            return self._wait_or_run(item)
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
