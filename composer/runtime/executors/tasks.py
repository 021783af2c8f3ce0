"""Tasks: how ``async def`` handlers run on a ``Loop``.

Not asyncio: its event loop cannot wait for DDS. A coroutine that runs here awaits a
:class:`~composer.runtime.executors.futures.Future`, another coroutine, or an rclpy future.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from composer.runtime.executors.futures import Awaited, Cancelled, Future, awaited_rclpy_future

T = TypeVar("T")

#: Called with (what was running, the exception). The loop reports it and continues.
Report = Callable[[str, BaseException], None]


class Cancellable(Protocol):
    """A scheduled call."""

    def cancel(self) -> None:
        """Do not make the call."""


class SupportsCallLater(Protocol):
    """A loop, which waits by the steady clock, or a node's clock."""

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> Cancellable:
        """Call ``callback`` once, ``delay_s`` seconds from now."""


class Task(Generic[T]):
    """Runs one coroutine, a step per call of the loop.

    Canceling ``future`` throws :class:`Cancelled` into the coroutine where it awaits; the awaited
    future is not canceled.
    """

    __slots__ = (
        "_awaited",
        "_begun",
        "_call_soon",
        "_cancelling",
        "_coroutine",
        "_finished",
        "_lock",
        "_on_end",
        "_report",
        "future",
    )

    def __init__(
        self,
        coroutine: Coroutine[Any, Any, T],
        call_soon: Callable[[Callable[[], object]], None],
        report: Report,
        on_end: Callable[[Task[T]], object],
    ) -> None:
        """``on_end`` is called when the coroutine has ended, possibly later than the future."""
        self._coroutine = coroutine
        self._call_soon = call_soon
        self._on_end = on_end
        self._report = partial(report, name_of(coroutine))
        self._lock = threading.Lock()  # a step and a cancellation may run on different threads
        self._awaited: object = None
        self._begun = False
        self._cancelling = False  # canceled while a step was running
        self._finished = False
        self.future: Future[T] = Future(self._report)
        self.future.add_done_callback(self._cancel)

    def start(self) -> Future[T]:
        """Schedule the first step; return the future of the result."""
        future = self.future  # another thread may have dropped it on return
        self._call_soon(self._begin)
        return future

    def close(self) -> None:
        """Close the coroutine now, on the calling thread: it will never be resumed."""
        with self._lock:
            if self._finished:
                return
            try:
                self._coroutine.close()
            except BaseException as error:
                self._report(error)
            self._end()
        self.future.cancel()

    def abandon(self) -> None:
        """Close the coroutine unless it has begun: the loop has stopped or is blocked."""
        if not self._lock.acquire(blocking=False):
            return
        try:
            if self._begun or self._finished:
                return
            self._coroutine.close()
            self._end()
        finally:
            self._lock.release()
        self.future.cancel()

    def _begin(self) -> None:
        self._begun = True
        if not self.future.cancelled():
            self._step(None)

    def _cancel(self, future: Future[T]) -> None:
        if future.cancelled() and not self._finished:
            self._call_soon(self._throw)

    def _throw(self) -> None:
        # Do not wait for a running step: it may be blocked, and this thread serves others too.
        self._cancelling = True
        if not self._lock.acquire(blocking=False):
            return
        try:
            self._cancelling = False
            if not self._finished:
                self._advance(self._coroutine.throw, Cancelled())
        finally:
            self._lock.release()

    def _step(self, awaited: object) -> None:
        with self._lock:
            # A canceled task may be woken by a future that it no longer awaits.
            if not self._finished and self._awaited is awaited:
                self._advance(self._coroutine.send, None)
        if self._cancelling:
            self._throw()

    def _advance(self, resume: Callable[[Any], object], argument: BaseException | None) -> None:
        while True:
            self._awaited = None
            try:
                yielded = resume(argument)
            except StopIteration as stop:
                self._end()
                self.future.set_result(stop.value)
                return
            except Cancelled:
                self._end()
                self.future.cancel()
                return
            except BaseException as error:
                self._end()
                self._fail(error)
                return
            if self._wait_for(yielded):
                return
            resume, argument = self._coroutine.throw, _not_awaitable(yielded)

    def _end(self) -> None:
        self._finished = True
        self._on_end(self)

    def _fail(self, error: BaseException) -> None:
        outcome = self.future
        if not outcome.set_exception(error):
            self._report(error)
            return
        # The traceback's frames refer to this task (since Python 3.12 by f_back). Drop the future,
        # so that it is deallocated, and its exception reported, as soon as it is unused.
        self.future = Future()
        self.future.set_exception(error)

    def _wait_for(self, yielded: object) -> bool:
        if isinstance(yielded, Future):
            self._awaited = yielded
            yielded.add_done_callback(self._wake)
            return True
        if yielded is not None:
            return False
        foreign = awaited_rclpy_future(self._coroutine)
        if foreign is None:
            self._wake(None)  # asyncio.sleep(0): let other callbacks run first
        else:
            self._awaited = foreign
            foreign.add_done_callback(self._wake)
        return True

    def _wake(self, awaited: object) -> None:
        self._call_soon(partial(self._step, awaited))


def sleep(clock: SupportsCallLater, delay_s: float) -> Future[None]:
    """Return a future that is done ``delay_s`` seconds from now."""
    future: Future[None] = Future()
    timer = clock.call_later(delay_s, lambda: future.set_result(None))
    future.add_done_callback(lambda _: timer.cancel())
    return future


async def wait_for(clock: SupportsCallLater, future: Awaited, timeout_s: float) -> bool:
    """Wait for ``future`` for up to ``timeout_s`` seconds; return whether it is done."""
    woken = sleep(clock, timeout_s)
    future.add_done_callback(lambda _: woken.set_result(None))
    try:
        if not future.done():
            await woken
    finally:
        woken.cancel()
    return future.done()


async def within(
    clock: SupportsCallLater, future: Future[T], timeout_s: float, after: Future[None] | None = None
) -> T:
    """Wait for ``future`` for up to ``timeout_s`` seconds, counted from when ``after`` is done.

    Raises TimeoutError. The future is canceled on a timeout and when the caller is canceled.
    """
    woken: Future[None] = Future()
    timers: list[Cancellable] = []

    def start_timer(_: object) -> None:
        timers.append(clock.call_later(timeout_s, lambda: woken.set_result(None)))

    future.add_done_callback(lambda _: woken.set_result(None))
    if after is None:
        start_timer(None)
    else:
        after.add_done_callback(start_timer)
    try:
        await woken
        if not future.done():
            raise TimeoutError(f"no answer within {timeout_s:g} s")
        return future.result()
    finally:
        for timer in timers:
            timer.cancel()
        future.cancel()


def name_of(called: object) -> str:
    """Return the qualified name of a callback or coroutine, for reports."""
    inner = getattr(called, "func", called)
    return str(getattr(inner, "__qualname__", None) or type(inner).__qualname__)


def _not_awaitable(yielded: object) -> TypeError:
    kind = type(yielded)
    return TypeError(
        f"cannot await {kind.__module__}.{kind.__qualname__} here: handlers run on the composer's "
        "loop, not on asyncio's; use self.clock.sleep, the node's clients, or a Future of the loop"
    )
