"""rclpy's own futures, awaited by coroutines on the composer's loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import pytest
from rclpy.task import Future as RclpyFuture

from composer.runtime.executors.futures import Future, wrap_future
from composer.runtime.executors.strand import SerialStrand
from composer.runtime.executors.tasks import Task


class Calls:
    is_parallel = False

    def __init__(self) -> None:
        self.waiting: deque[Callable[[], object]] = deque()
        self.called = 0

    def call_soon(self, callback: Callable[[], object]) -> None:
        self.waiting.append(callback)

    def overlap(self) -> None:
        raise AssertionError("a loop of one thread")

    def run(self) -> None:
        while self.waiting:
            self.called += 1
            self.waiting.popleft()()


def start(calls: Calls, awaited: Any, on_strand: bool = False) -> Future[Any]:
    async def inner() -> Any:
        return await awaited

    async def outer() -> Any:
        return await inner()

    def report(what: str, error: BaseException) -> None:
        raise error

    work = SerialStrand(calls).wrap(outer()) if on_strand else outer()
    future = Task(work, calls.call_soon, report, lambda _: None).start()
    calls.run()
    return future


@pytest.mark.parametrize("on_strand", [False, True])
def test_an_rclpy_future_is_not_polled(on_strand: bool) -> None:
    calls = Calls()
    foreign = RclpyFuture()
    outcome = start(calls, foreign, on_strand)
    called = calls.called
    calls.run()
    assert calls.called == called
    foreign.set_result("answer")
    calls.run()
    assert outcome.result() == "answer"
    if not on_strand:
        assert (called, calls.called) == (1, 2)


def test_an_rclpy_future_that_failed_raises_where_it_is_awaited() -> None:
    calls = Calls()
    foreign = RclpyFuture()
    outcome = start(calls, foreign)
    foreign.set_exception(ValueError("broken"))
    calls.run()
    with pytest.raises(ValueError, match="broken"):
        outcome.result()


def test_a_wrapped_future_has_the_outcome_of_the_rclpy_future_and_cancels_both_ways() -> None:
    foreign, failing, canceled, canceling = (RclpyFuture() for _ in range(4))
    future = wrap_future(foreign)
    assert not future.done()
    foreign.set_result("answer")
    assert future.result() == "answer"
    failed = wrap_future(failing)
    failing.set_exception(ValueError("broken"))
    assert isinstance(failed.exception(), ValueError)
    wrap_future(canceled).cancel()
    assert canceled.cancelled()
    future = wrap_future(canceling)
    canceling.cancel()
    assert future.cancelled()
