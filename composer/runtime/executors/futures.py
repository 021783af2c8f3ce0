"""Futures: results that come later, of this package or of rclpy."""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator
from typing import Any, Generic, Protocol, TypeVar, cast

T = TypeVar("T")


class Awaited(Protocol):
    """A future of rclpy or of this package, as far as a loop waits for it."""

    def done(self) -> bool:
        """Return whether it has a result or an exception."""

    def add_done_callback(self, callback: Callable[[Any], object]) -> object:
        """Call ``callback`` once it is done."""


class Cancelled(BaseException):
    """Raised at the ``await`` of a coroutine whose task was canceled, and by a canceled future.

    Not an ``Exception``, so that a handler's ``except Exception`` does not swallow it.
    """


class Future(Generic[T]):
    """A result that comes later.

    Every method may be called from any thread. The first of ``set_result``, ``set_exception`` and
    ``cancel`` wins and returns true.
    """

    __slots__ = ("__weakref__", "_callbacks", "_outcomes", "_report")

    def __init__(self, report: Callable[[BaseException], None] | None = None) -> None:
        """``report`` is called with an exception that was never retrieved, on deallocation."""
        # Appending to a list and popping from it are atomic, so a future needs no lock: the first
        # outcome counts.
        self._outcomes: list[tuple[T | None, _Failure | None, bool]] = []
        self._callbacks: list[Callable[[Future[T]], object]] = []
        self._report = report

    def done(self) -> bool:
        """Return whether there is a result, an exception or a cancellation."""
        return bool(self._outcomes)

    def cancelled(self) -> bool:
        """Return whether the future was canceled."""
        return bool(self._outcomes) and self._outcomes[0][2]

    def set_result(self, value: T) -> bool:
        """Set the result; return false if the future is done already."""
        return self._finish((value, None, False))

    def set_exception(self, error: BaseException) -> bool:
        """Set an exception; return false if the future is done already."""
        failure = _Failure(error, self._report)
        if self._finish((None, failure, False)):
            return True
        failure.report = None
        return False

    def cancel(self) -> bool:
        """Cancel the future; return false if it is done already."""
        return self._finish((None, None, True))

    def exception(self) -> BaseException | None:
        """Return the exception, or None. Once retrieved, it is not reported."""
        failure = self._outcomes[0][1] if self._outcomes else None
        return None if failure is None else failure.retrieve()

    def result(self) -> T:
        """Return the result.

        Raises the exception that was set, Cancelled, or RuntimeError if the future is not done.
        """
        if not self._outcomes:
            raise RuntimeError("the future has no result yet")
        value, failure, is_cancelled = self._outcomes[0]
        if failure is not None:
            raise failure.retrieve()
        if is_cancelled:
            raise Cancelled
        return cast("T", value)

    def add_done_callback(self, callback: Callable[[Future[T]], object]) -> None:
        """Call ``callback(self)`` on the thread that ends the future; at once if it is done."""
        self._callbacks.append(callback)
        if self._outcomes:
            self._run_callbacks()

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
            self._run_callbacks()
        return True

    def _run_callbacks(self) -> None:
        callbacks = self._callbacks
        while callbacks:
            try:
                callback = callbacks.pop(0)
            except IndexError:
                return  # another thread calls it
            try:
                callback(self)
            except BaseException:
                self._run_callbacks()  # the others are called nevertheless
                raise


class _Failure:
    """The exception of a future; reported on deallocation unless it was retrieved."""

    __slots__ = ("error", "report")

    def __init__(
        self, error: BaseException, report: Callable[[BaseException], None] | None
    ) -> None:
        self.error = error
        self.report = report

    def retrieve(self) -> BaseException:
        self.report = None
        return self.error

    def __del__(self) -> None:
        if self.report is not None:
            self.report(self.error)


def done_event(future: Awaited) -> threading.Event:
    """Return an event that is set once a future is done."""
    event = threading.Event()
    future.add_done_callback(lambda _: event.set())
    if future.done():
        event.set()
    return event


def wrap_future(
    foreign: Any,
    report: Callable[[BaseException], None] | None = None,
    *,
    cancels: bool = True,
) -> Future[Any]:
    """Return a future with the outcome of another, which may be an ``rclpy.task.Future``.

    Canceling one cancels the other; without ``cancels``, canceling the returned one does not.
    ``report`` is as for :class:`Future`.
    """
    future: Future[Any] = Future(report)

    def copy_outcome(_: object) -> None:
        if foreign.cancelled():
            future.cancel()
        elif (error := foreign.exception()) is not None:
            future.set_exception(error)
        else:
            future.set_result(foreign.result())

    foreign.add_done_callback(copy_outcome)
    if cancels:
        future.add_done_callback(lambda done: foreign.cancel() if done.cancelled() else None)
    return future


def awaited_rclpy_future(coroutine: object) -> Any:
    """Return the rclpy future at the end of a coroutine's chain of awaits, or None.

    ``rclpy.task.Future.__await__`` yields None until it is done, because rclpy's executors poll.
    The future is read from the frame instead, so that no polling is needed.
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
