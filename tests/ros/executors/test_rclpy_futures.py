"""rclpy's own futures, awaited by coroutines on the composer's loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import pytest
from rclpy.task import Future as RclpyFuture

from composer.runtime.executors.futures import Future, wrap_future
from composer.runtime.executors.strand import SerialStrand, Strand
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


def start(calls: Calls, awaited: Any, strand: Strand | None = None) -> Future[Any]:
    async def inner() -> Any:
        return await awaited

    async def outer() -> Any:
        return await inner()

    def report(what: str, error: BaseException) -> None:
        raise error

    work = outer() if strand is None else strand.wrap(outer())
    future = Task(work, calls.call_soon, report, lambda _: None).start()
    calls.run()
    return future


def test_an_rclpy_future_is_not_polled() -> None:
    calls = Calls()
    foreign = RclpyFuture()
    outcome = start(calls, foreign)
    assert calls.called == 1
    foreign.set_result("answer")
    calls.run()
    assert outcome.result() == "answer"
    assert calls.called == 2


def test_an_rclpy_future_is_not_polled_on_a_strand_either() -> None:
    calls = Calls()
    foreign = RclpyFuture()
    outcome = start(calls, foreign, SerialStrand(calls))
    called = calls.called
    calls.run()
    assert calls.called == called
    foreign.set_result("answer")
    calls.run()
    assert outcome.result() == "answer"


def test_an_rclpy_future_that_failed_raises_where_it_is_awaited() -> None:
    calls = Calls()
    foreign = RclpyFuture()
    outcome = start(calls, foreign)
    foreign.set_exception(ValueError("broken"))
    calls.run()
    with pytest.raises(ValueError, match="broken"):
        outcome.result()


def test_a_wrapped_future_has_the_outcome_of_the_rclpy_future() -> None:
    foreign = RclpyFuture()
    future = wrap_future(foreign)
    assert not future.done()
    foreign.set_result("answer")
    assert future.result() == "answer"
    failing = RclpyFuture()
    failed = wrap_future(failing)
    failing.set_exception(ValueError("broken"))
    assert isinstance(failed.exception(), ValueError)


def test_canceling_works_in_both_directions_of_a_wrapped_future() -> None:
    foreign = RclpyFuture()
    wrap_future(foreign).cancel()
    assert foreign.cancelled()
    foreign = RclpyFuture()
    future = wrap_future(foreign)
    foreign.cancel()
    assert future.cancelled()
