"""One callback of a node at a time, whichever threads its loop has.

A loop of one thread gives that by itself; on several threads a node's callbacks take turns here,
without holding up a thread while they wait.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Coroutine, Generator
from functools import partial
from typing import Any, Protocol, TypeVar

from composer.runtime.executors.tasks import Future, awaited_rclpy_future, wrap_future

T = TypeVar("T")

#: Does the work for one item; what it returns, if anything, is awaited. Must not raise.
Work = Callable[[T], "Coroutine[Any, Any, None] | None"]


class Strand(Protocol):
    """Runs the callbacks of one node. Callbacks given to it must not raise."""

    def post(self, call: Callable[[], object]) -> None:
        """Run ``call`` now, or when those before it are through."""

    def wrap(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return a coroutine each step of which is a turn of its own."""


class InlineStrand:
    """The strand of a node whose loop has one thread, and of ports that may overlap."""

    def post(self, call: Callable[[], object]) -> None:
        """Run ``call`` now."""
        call()

    def wrap(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return ``coroutine`` itself."""
        return coroutine


class SerialStrand:
    """The strand of a node whose loop has several threads."""

    def __init__(self, call_soon: Callable[[Callable[[], object]], None]) -> None:
        self._call_soon = call_soon
        self._lock = threading.Lock()
        self._taken = False
        # A waiting coroutine is a future: finishing it hands the turn over.
        self._queue: deque[Callable[[], object] | Future[None]] = deque()

    def post(self, call: Callable[[], object]) -> None:
        """Run ``call`` now, or when those before it are through."""
        with self._lock:
            if self._taken:
                self._queue.append(call)
                return
            self._taken = True
        self._run(call)

    def wrap(self, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return a coroutine each step of which is a turn of its own."""
        return in_steps(self, coroutine)

    def enter(self) -> Future[None] | None:
        """Take the turn; where it is taken, return the future that will give it."""
        with self._lock:
            if self._taken:
                turn: Future[None] = Future()
                self._queue.append(turn)
                return turn
            self._taken = True
            return None

    def leave(self) -> None:
        """Give the turn to whoever is next."""
        while True:
            with self._lock:
                if not self._queue:
                    self._taken = False
                    return
                following = self._queue.popleft()
            if isinstance(following, Future):
                if following.set_result(None):
                    return
                continue  # it gave up waiting
            self._call_soon(partial(self._run, following))
            return

    def _run(self, call: Callable[[], object]) -> None:
        try:
            call()
        finally:
            self.leave()


class Around(Protocol):
    """What is done before and after each step of a coroutine."""

    def enter(self) -> Future[None] | None:
        """Begin a step, or return the future that is done when it may begin."""

    def leave(self) -> None:
        """End the step."""


def in_steps(around: Around, coroutine: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
    """Return what drives ``coroutine`` step by step, from one wait to the next."""
    return _InSteps(around, coroutine)


class _InSteps(Coroutine[Any, Any, T]):
    """Ended before it has begun, it ends the coroutine that it drives as well.

    That would be garbage, and Python's complaint that it was never awaited.
    """

    __slots__ = ("_driven", "_steps")

    def __init__(self, around: Around, driven: Coroutine[Any, Any, T]) -> None:
        self._driven = driven
        self._steps = _steps(around, driven)

    def __await__(self) -> Generator[Any, Any, T]:
        return self._steps

    def send(self, value: Any) -> Any:
        return self._steps.send(value)

    def throw(self, *raised: Any) -> Any:
        try:
            return self._steps.throw(*raised)
        except BaseException:
            self._driven.close()
            raise

    def close(self) -> None:
        self._steps.close()
        self._driven.close()


def _steps(around: Around, coroutine: Coroutine[Any, Any, T]) -> Generator[Any, Any, T]:
    raised: BaseException | None = None
    try:
        while True:
            yield from _entered(around)
            try:
                yielded = coroutine.send(None) if raised is None else coroutine.throw(raised)
            except StopIteration as stop:
                return stop.value  # type: ignore[no-any-return]
            finally:
                around.leave()
            raised = None
            # rclpy's futures yield nothing and want to be polled: wait for them instead.
            foreign = awaited_rclpy_future(coroutine) if yielded is None else None
            try:
                yield yielded if foreign is None else wrap_future(foreign)
            except GeneratorExit:
                raise
            except BaseException as error:
                raised = error
    finally:
        coroutine.close()


def _entered(around: Around) -> Generator[Any, Any, None]:
    turn = around.enter()
    if turn is None:
        return
    try:
        yield from turn.__await__()
    except BaseException:
        if not turn.cancel():  # the turn had come already
            around.leave()
        raise
