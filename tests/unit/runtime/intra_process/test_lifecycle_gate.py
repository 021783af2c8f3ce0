"""Pending futures, each with a deadline, on one timer."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from math import inf
from time import monotonic
from types import SimpleNamespace
from typing import cast

import pytest

from composer.runtime.clock import COMPUTER
from composer.runtime.executors.base_loop import BaseLoop
from composer.runtime.executors.futures import Future
from composer.runtime.intra_process.lifecycle_gate import PendingFutures


class Clock:
    """A loop, and its clock that the test advances."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.timers: list[tuple[float, Callable[[], object]]] = []
        self.ordered = 0
        self.clock = self

    def monotonic(self) -> float:
        return self.now_s

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> None:
        self.ordered += 1
        self.timers.append((self.now_s + delay_s, callback))

    def pass_s(self, seconds: float) -> None:
        """Advance the time, from timer to timer."""
        end_s = self.now_s + seconds
        while due := [timer for timer in self.timers if timer[0] <= end_s]:
            timer = min(due, key=lambda entry: entry[0])
            self.timers.remove(timer)
            self.now_s = max(self.now_s, timer[0])
            timer[1]()
        self.now_s = end_s


class TooLate(Exception):
    pass


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def pending(clock: Clock) -> PendingFutures:
    return PendingFutures(cast("BaseLoop", clock))


def hold(pending: PendingFutures, until_s: float) -> Future[str]:
    return pending.add(Future(), until_s, TooLate)


def test_each_future_fails_at_its_deadline(clock: Clock, pending: PendingFutures) -> None:
    ends_s = (105.0, 103.0, 104.0, 103.0, 109.0, 99.0)
    futures = [hold(pending, end_s) for end_s in ends_s]
    answered = hold(pending, 103.0)
    answered.set_result("answer")
    assert not any(future.done() for future in futures), "one ends at the next poll"
    for second in range(100, 111):
        clock.pass_s(float(second > 100))
        assert [future.done() for future in futures] == [end_s <= second for end_s in ends_s]
    assert all(isinstance(future.exception(), TooLate) for future in futures)
    assert answered.result() == "answer"
    assert not clock.timers


def test_consecutive_calls_share_one_timer(clock: Clock, pending: PendingFutures) -> None:
    for _ in range(1000):
        hold(pending, clock.now_s + 5.0).set_result("answer")
        clock.pass_s(0.001)
    assert clock.ordered == 1
    unanswered = hold(pending, clock.now_s + 5.0)
    clock.pass_s(4.5)
    assert clock.ordered == 2  # the first one has fired meanwhile
    assert not unanswered.done()
    clock.pass_s(0.5)
    assert isinstance(unanswered.exception(), TooLate)
    assert not clock.timers


def test_a_call_without_a_limit_needs_no_timer_and_ends_on_close(
    clock: Clock, pending: PendingFutures
) -> None:
    unlimited, limited = pending.add(Future()), hold(pending, 103.0)
    assert clock.ordered == 1
    clock.pass_s(1000.0)
    assert not unlimited.done()
    last = hold(pending, inf)
    pending.fail_all(lambda: ValueError("over"))
    for future in (unlimited, last):
        assert str(future.exception()) == "over"
    assert isinstance(limited.exception(), TooLate)
    assert hold(pending, 2000.0).done() is False, "the end of others is not its own"


def test_a_future_that_is_done_is_discarded(pending: PendingFutures) -> None:
    done: Future[str] = Future()
    done.set_result("answer")
    futures = [pending.add(done), hold(pending, 200.0), hold(pending, 200.0)]
    futures[1].cancel()
    futures[2].set_result("answer")
    left = weakref.WeakSet(futures)
    del done, futures
    gc.collect()
    assert not left


def test_waiting_again_after_a_timeout_holds_again(clock: Clock, pending: PendingFutures) -> None:
    seen: list[Future[str]] = []
    hold(pending, 101.0).add_done_callback(lambda _: seen.append(hold(pending, 102.0)))
    clock.pass_s(1.0)
    assert [future.done() for future in seen] == [False]
    clock.pass_s(1.0)
    assert [future.done() for future in seen] == [True]


def test_no_future_is_lost_while_threads_add_and_the_timer_checks() -> None:
    due: list[Callable[[], object]] = []
    loop = SimpleNamespace(clock=COMPUTER, call_later=lambda _, look: due.append(look))
    pending = PendingFutures(cast("BaseLoop", loop))

    def hold_some(_: int) -> list[Future[str]]:
        return [hold(pending, monotonic()) for _ in range(200)]

    with ThreadPoolExecutor(3) as pool:
        making = [pool.submit(hold_some, number) for number in range(3)]
        # In this order: a completed request is not due any more.
        while not all(made.done() for made in making) or due:
            if due:
                due.pop(0)()
    assert all(future.done() for made in making for future in made.result())
