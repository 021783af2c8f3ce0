"""Futures and tasks: how ``async def`` handlers run on a ``Loop``.

Not asyncio: its event loop knows nothing of DDS. A coroutine that runs here awaits a
:class:`Future`, another coroutine, or an rclpy future.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Coroutine, Generator
from functools import partial
from typing import Any, Generic, Protocol, TypeVar, cast

T = TypeVar("T")

#: Called with (what was running, the exception).
Report = Callable[[str, BaseException], None]


class Cancelled(BaseException):
    """Raised at the ``await`` of a coroutine whose task was cancelled, and by a cancelled future.

    Not an ``Exception``, so that a handler's ``except Exception`` does not swallow it.
    """


class Future(Generic[T]):
    """An outcome that comes later.

    Every method may be called from any thread; the first of ``set_result``, ``set_exception``
    and ``cancel`` wins, and answers true.
    """

    __slots__ = ("__weakref__", "_callbacks", "_outcomes", "_report")

    def __init__(self, report: Callable[[BaseException], None] | None = None) -> None:
        """``report`` is told of an exception that nobody asked for, when the future is dropped."""
        # Appending to a list and popping from it are atomic, so a future needs no lock: of the
        # outcomes the first one counts.
        self._outcomes: list[tuple[T | None, _Failure | None, bool]] = []
        self._callbacks: list[Callable[[Future[T]], object]] = []
        self._report = report

    def done(self) -> bool:
        """Tell whether there is an outcome: a result, an exception or a cancellation."""
        return bool(self._outcomes)

    def cancelled(self) -> bool:
        """Tell whether the outcome is a cancellation."""
        return bool(self._outcomes) and self._outcomes[0][2]

    def set_result(self, value: T) -> bool:
        """Finish with a result; false when there is an outcome already."""
        return self._finish((value, None, False))

    def set_exception(self, error: BaseException) -> bool:
        """Finish with an exception; false when there is an outcome already."""
        failure = _Failure(error, self._report)
        if self._finish((None, failure, False)):
            return True
        failure.report = None
        return False

    def cancel(self) -> bool:
        """Finish as cancelled; false when there is an outcome already."""
        return self._finish((None, None, True))

    def exception(self) -> BaseException | None:
        """Return the exception, or None. An exception asked for is not reported any more."""
        failure = self._outcomes[0][1] if self._outcomes else None
        return None if failure is None else failure.ask()

    def result(self) -> T:
        """Return the result.

        Raises the exception that was set, Cancelled, or RuntimeError while there is no outcome.
        """
        if not self._outcomes:
            raise RuntimeError("the future has no result yet")
        value, failure, is_cancelled = self._outcomes[0]
        if failure is not None:
            raise failure.ask()
        if is_cancelled:
            raise Cancelled
        return cast(T, value)

    def add_done_callback(self, callback: Callable[[Future[T]], object]) -> None:
        """Call ``callback(self)`` on whichever thread finishes this; at once when it is done."""
        self._callbacks.append(callback)
        if self._outcomes:
            self._call_back()

    def __await__(self) -> Generator[Future[T], None, T]:
        if not self._outcomes:
            yield self
        return self.result()

    def _finish(self, outcome: tuple[T | None, _Failure | None, bool]) -> bool:
        outcomes = self._outcomes
        if outcomes:
            return False
        outcomes.append(outcome)
        if outcomes[0] is not outcome:  # another thread was faster
            return False
        if self._callbacks:
            self._call_back()
        return True

    def _call_back(self) -> None:
        callbacks = self._callbacks
        while callbacks:
            try:
                callback = callbacks.pop(0)
            except IndexError:
                return  # another thread calls it
            try:
                callback(self)
            except BaseException:
                self._call_back()  # the others are told all the same
                raise


class _Failure:
    """The exception of a future, reported when it goes and nobody has asked for it."""

    __slots__ = ("error", "report")

    def __init__(
        self, error: BaseException, report: Callable[[BaseException], None] | None
    ) -> None:
        self.error = error
        self.report = report

    def ask(self) -> BaseException:
        self.report = None
        return self.error

    def __del__(self) -> None:
        if self.report is not None:
            self.report(self.error)


class Clock(Protocol):
    """Who waits: a loop by the steady clock, or a node's clock."""

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> Cancellable:
        """Call ``callback`` once, ``delay_s`` seconds from now."""


class Cancellable(Protocol):
    """A call that can still be called off."""

    def cancel(self) -> None:
        """Never call."""


class Task(Generic[T]):
    """Drives one coroutine, a step per call of the loop.

    Cancelling ``future`` throws :class:`Cancelled` into the coroutine where it awaits; what it
    awaits is left alone.
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
        """``on_end`` is called when the coroutine has ended, which may be after the future."""
        self._coroutine = coroutine
        self._call_soon = call_soon
        self._on_end = on_end
        self._report = partial(report, name_of(coroutine))
        self._lock = threading.Lock()  # a cancellation may meet a running step on another thread
        self._awaited: object = None
        self._begun = False
        self._cancelling = False  # a cancellation has met a running step
        self._finished = False
        self.future: Future[T] = Future(self._report)
        self.future.add_done_callback(self._cancel)

    def start(self) -> Future[T]:
        """Have the loop begin; return the outcome."""
        self._call_soon(self._begin)
        return self.future

    def close(self) -> None:
        """End the coroutine now, on the calling thread, as when nothing will ever resume it."""
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
        """End the coroutine if it has not begun: the loop has stopped, or hangs and never will."""
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
        # Not to wait for a running step: it may hang, and this thread is the loop's next best.
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
            # A cancelled task may be woken by what it no longer waits for.
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
        # The frames of the traceback lead to this task (from Python 3.12 on by way of f_back). So
        # that the outcome goes as soon as nobody wants it, the task lets go of it.
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
            self._wake(None)  # asyncio.sleep(0): let others run first
        else:
            self._awaited = foreign
            foreign.add_done_callback(self._wake)
        return True

    def _wake(self, awaited: object) -> None:
        self._call_soon(partial(self._step, awaited))


def sleep(clock: Clock, delay_s: float) -> Future[None]:
    """Return a future that is done ``delay_s`` seconds from now."""
    future: Future[None] = Future()
    timer = clock.call_later(delay_s, lambda: future.set_result(None))
    future.add_done_callback(lambda _: timer.cancel())
    return future


async def within(
    clock: Clock, future: Future[T], timeout_s: float, after: Future[None] | None = None
) -> T:
    """Wait for ``future`` for at most ``timeout_s`` seconds, which begin once ``after`` is done.

    Raises TimeoutError when it takes longer. A future not waited for any more, because of that
    or because the caller was cancelled, is cancelled.
    """
    woken: Future[None] = Future()
    timers: list[Cancellable] = []

    def begin(_: object) -> None:
        timers.append(clock.call_later(timeout_s, lambda: woken.set_result(None)))

    future.add_done_callback(lambda _: woken.set_result(None))
    if after is None:
        begin(None)
    else:
        after.add_done_callback(begin)
    try:
        await woken
        if not future.done():
            raise TimeoutError(f"no answer within {timeout_s:g} s")
        return future.result()
    finally:
        for timer in timers:
            timer.cancel()
        future.cancel()


def wrap_future(foreign: Any, report: Callable[[BaseException], None] | None = None) -> Future[Any]:
    """Return a future with the outcome of another, which may be an ``rclpy.task.Future``.

    Cancelling one cancels the other. ``report`` is as for :class:`Future`.
    """
    future: Future[Any] = Future(report)

    def take_over(_: object) -> None:
        if foreign.cancelled():
            future.cancel()
        elif (error := foreign.exception()) is not None:
            future.set_exception(error)
        else:
            future.set_result(foreign.result())

    foreign.add_done_callback(take_over)
    future.add_done_callback(lambda done: foreign.cancel() if done.cancelled() else None)
    return future


def name_of(called: object) -> str:
    """Return the name people know a callback or coroutine by."""
    inner = getattr(called, "func", called)
    return str(getattr(inner, "__qualname__", None) or type(inner).__qualname__)


def _not_awaitable(yielded: object) -> TypeError:
    kind = type(yielded)
    return TypeError(
        f"cannot await {kind.__module__}.{kind.__qualname__} here: handlers run on the composer's "
        "loop, not on asyncio's; use self.clock.sleep, the node's clients, or a Future of the loop"
    )


def awaited_rclpy_future(coroutine: object) -> Any:
    """Return the rclpy future at the end of the chain of awaits, or None.

    ``rclpy.task.Future.__await__`` yields None until it is done, for its executors poll. Looking
    at which future it belongs to spares us the polling.
    """
    innermost = coroutine
    while (
        inner := getattr(innermost, "cr_await", None) or getattr(innermost, "gi_yieldfrom", None)
    ) is not None:
        innermost = inner
    frame = getattr(innermost, "gi_frame", None)
    if frame is None or frame.f_code.co_name != "__await__":
        return None
    owner = frame.f_locals.get("self")
    return owner if hasattr(owner, "add_done_callback") else None
