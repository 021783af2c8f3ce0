"""Strands: run one callback of a node at a time, on a loop with any number of threads.

A loop whose callbacks do not overlap needs no strand. On others, a strand queues the callbacks of a
node without blocking a thread while they wait.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Coroutine, Generator
from functools import partial
from types import FrameType
from typing import Any, Protocol, TypeVar

from composer.runtime.executors.futures import Future, awaited_rclpy_future, wrap_future
from composer.runtime.executors.tracebacks import calls_user_code
from composer.runtime.executors.turns import TurnTaking

T = TypeVar("T")

#: Handles one item; a coroutine that it returns is awaited. Must not raise.
Work = Callable[[T], "Coroutine[Any, Any, None] | None"]


class Strand(Protocol):
    """Runs the callbacks of one node, which must not raise."""

    def post(self, call: Callable[[], object]) -> None:
        """Run ``call`` now, or after the calls that were posted before it."""

    def wrap(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return a coroutine that runs each step of ``coroutine`` on the strand."""


class InlineStrand:
    """The strand of a node whose loop calls one callback at a time."""

    def post(self, call: Callable[[], object]) -> None:
        """Run ``call`` now."""
        call()

    def wrap(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return ``coroutine`` itself."""
        return coroutine


class ReentrantStrand(InlineStrand):
    """The strand of a reentrant callback group: its callbacks overlap on several threads."""

    def __init__(self, loop: TurnTaking) -> None:
        self._loop = loop

    def post(self, call: Callable[[], object]) -> None:
        """Run ``call`` now."""
        self._loop.overlap()
        call()


class SerialStrand:
    """The strand of a node whose callbacks the loop may let overlap or wait."""

    def __init__(self, loop: TurnTaking) -> None:
        self._call_soon = loop.call_soon
        self._overlap = loop.overlap if loop.is_parallel else None
        self._lock = threading.Lock()
        self._is_held = False
        # A waiting coroutine is a future: setting its result hands the strand over.
        self._queue: deque[Callable[[], object] | Future[None]] = deque()

    def post(self, call: Callable[[], object]) -> None:
        """Run ``call`` now, or after the calls that were posted before it."""
        with self._lock:
            if self._is_held:
                self._queue.append(call)
                return
            self._is_held = True
        self._run(call)

    def wrap(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return a coroutine that runs each step of ``coroutine`` on the strand."""
        return in_steps(self, coroutine)

    def enter(self) -> Future[None] | None:
        """Acquire the strand; if it is held, return a future that is done once it is acquired."""
        with self._lock:
            if self._is_held:
                acquired: Future[None] = Future()
                self._queue.append(acquired)
                return acquired
            self._is_held = True
            return None

    def leave(self) -> None:
        """Release the strand to the next in the queue."""
        while True:
            with self._lock:
                if not self._queue:
                    self._is_held = False
                    return
                following = self._queue.popleft()
            if isinstance(following, Future):
                if following.set_result(None):
                    return
                continue  # canceled while it waited
            self._call_soon(partial(self._run, following))
            return

    def _run(self, call: Callable[[], object]) -> None:
        try:
            if self._overlap is not None:
                self._overlap()
            call()
        finally:
            self.leave()


class StepScope(Protocol):
    """Called before and after each step of a coroutine."""

    def enter(self) -> Future[None] | None:
        """Begin a step, or return a future that is done when the step may begin."""

    def leave(self) -> None:
        """End the step."""


def in_steps(
    scope: StepScope,
    coroutine: Coroutine[Any, Any, T],
    on_end: Callable[[], None] | None = None,
) -> Coroutine[Any, Any, T]:
    """Return a coroutine that runs each step of ``coroutine``, up to its next wait, in scope.

    ``on_end()`` is called at its end if it has begun.
    """
    return OuterCoroutine(_steps(scope, coroutine, on_end), coroutine)


class ExclusiveStrand(SerialStrand):
    """A strand on which a callback that awaits keeps the others waiting."""

    def wrap(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return a coroutine that holds the strand until it has ended."""
        return OuterCoroutine(_whole(self, coroutine), coroutine)


class OuterCoroutine(Coroutine[Any, Any, T]):
    """A coroutine that awaits an inner one, and closes it too if it is closed before it has begun.

    Otherwise Python would warn that the inner coroutine was never awaited.
    """

    __slots__ = ("_inner", "_outer")

    def __init__(
        self,
        outer: Coroutine[Any, Any, T] | Generator[Any, Any, T],
        inner: Coroutine[Any, Any, Any],
    ) -> None:
        self._outer = outer
        self._inner = inner

    @property
    def cr_await(self) -> object:
        """What it awaits, as of other coroutines."""
        return self._outer

    def __await__(self) -> Generator[Any, Any, T]:
        return self._outer if isinstance(self._outer, Generator) else self._outer.__await__()

    def send(self, value: Any) -> Any:
        """Run the next step."""
        return self._outer.send(value)

    def throw(self, *raised: Any) -> Any:
        """Run the next step, which begins with an exception."""
        try:
            return self._outer.throw(*raised)
        except BaseException:
            self._inner.close()
            raise

    def close(self) -> None:
        """End both."""
        self._outer.close()
        self._inner.close()


@calls_user_code
def _steps(
    scope: StepScope, coroutine: Coroutine[Any, Any, T], on_end: Callable[[], None] | None = None
) -> Generator[Any, Any, T]:
    raised: BaseException | None = None
    try:
        while True:
            yield from _enter(scope)
            try:
                yielded = coroutine.send(None) if raised is None else coroutine.throw(raised)
            except StopIteration as stop:
                return stop.value  # type: ignore[no-any-return]
            finally:
                scope.leave()
            raised = None
            # rclpy's futures yield None and expect to be polled: await them instead.
            foreign = awaited_rclpy_future(coroutine) if yielded is None else None
            try:
                yield yielded if foreign is None else wrap_future(foreign)
            except GeneratorExit:
                raise
            except BaseException as error:
                raised = error
    except BaseException:
        coroutine.close()
        raise
    finally:
        if on_end is not None:
            on_end()


def _enter(scope: StepScope) -> Generator[Any, Any, None]:
    entered = scope.enter()
    if entered is None:
        return
    try:
        yield from entered.__await__()
    except BaseException:
        if not entered.cancel():  # it was entered already
            scope.leave()
        raise


def scope_of(frame: FrameType) -> object:
    """Return the scope of the step that a frame of a stack runs, or None if it runs none."""
    return frame.f_locals["scope"] if frame.f_code is _steps.__code__ else None


class _NoScope:
    def enter(self) -> None:
        """Begin at once."""

    def leave(self) -> None:
        """Do nothing."""


def _whole(scope: StepScope, coroutine: Coroutine[Any, Any, T]) -> Generator[Any, Any, T]:
    try:
        yield from _enter(scope)
        try:
            return (yield from _steps(_NoScope(), coroutine))
        finally:
            scope.leave()
    finally:
        coroutine.close()
