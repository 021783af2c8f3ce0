"""The queue of scheduled calls, on the steady clock."""

from __future__ import annotations

import gc
import math
from time import monotonic

import pytest

from composer.runtime.clock import COMPUTER
from composer.runtime.executors.base_loop import ScheduledCall, TimerQueue


def call(due_s: float, period_s: float | None = None) -> ScheduledCall:
    return ScheduledCall(COMPUTER.monotonic, due_s, period_s, lambda: None)


def take_due(queue: TimerQueue[ScheduledCall]) -> list[ScheduledCall]:
    taken = []
    while queue.next_due_s() <= monotonic():
        taken.append(queue.pop())
    return taken


@pytest.fixture
def queue() -> TimerQueue[ScheduledCall]:
    return TimerQueue[ScheduledCall](COMPUTER.monotonic)


def test_pops_due_calls_in_order_and_keeps_the_rest(queue: TimerQueue[ScheduledCall]) -> None:
    assert queue.next_due_s() == queue.next_s == math.inf
    now_s = monotonic()
    late, later = call(now_s - 2.0), call(now_s + 60.0)
    at_once = [call(now_s - 1.0) for _ in range(10)]
    for item in (later, *at_once, late):
        queue.add(item)
    assert queue.next_s == late.due_s
    assert take_due(queue) == [late, *at_once]
    assert take_due(queue) == []
    assert queue.next_due_s() == queue.next_s == later.due_s


def test_a_canceled_call_is_neither_made_nor_waited_for(queue: TimerQueue[ScheduledCall]) -> None:
    now_s = monotonic()
    due, next_one, last = call(now_s - 1.0), call(now_s + 30.0), call(now_s + 60.0)
    for item in (due, next_one, last):
        queue.add(item)
    due.cancel()
    next_one.cancel()
    next_one.cancel()
    assert take_due(queue) == []
    assert queue.next_due_s() == last.due_s


def test_canceled_calls_do_not_accumulate(queue: TimerQueue[ScheduledCall]) -> None:
    def count() -> int:
        gc.collect()
        return sum(type(item) is ScheduledCall for item in gc.get_objects())

    before = count()
    for _ in range(2_000):
        item = call(monotonic() + 60.0)
        queue.add(item)
        item.cancel()
    assert count() < before + 200


def test_a_periodic_call_keeps_its_phase_and_skips_missed_periods(
    queue: TimerQueue[ScheduledCall],
) -> None:
    begin_s = monotonic() - 350.0
    item = call(begin_s, period_s=100.0)
    queue.reschedule(item)  # called 3.5 periods late
    assert item.due_s == pytest.approx(begin_s + 400.0)
    assert queue.next_s == item.due_s
    in_time = call(begin_s + 350.0, period_s=60.0)
    queue.reschedule(in_time)
    assert in_time.due_s == pytest.approx(begin_s + 410.0)


def test_a_popped_call_counts_for_the_next_due_time(queue: TimerQueue[ScheduledCall]) -> None:
    begin_s = monotonic() - 1.0
    once, often = call(begin_s), call(begin_s + 0.5, period_s=60.0)
    queue.add(once)
    queue.add(often)
    assert queue.pop() is once
    assert queue.next_s == often.due_s
    assert queue.pop() is often
    assert queue.next_s == begin_s + 60.5
    queue.add(call(begin_s + 30.0))
    assert queue.next_s == begin_s + 30.0


def test_canceled_and_single_calls_are_not_repeated(queue: TimerQueue[ScheduledCall]) -> None:
    single, canceled = call(monotonic()), call(monotonic(), period_s=1.0)
    canceled.cancel()
    for item in (single, canceled):
        queue.reschedule(item)
    assert queue.next_due_s() == math.inf


@pytest.mark.parametrize(
    ("due_s", "period_s", "problem"),
    [
        (0.0, 0.0, "a period must be positive"),
        (0.0, -1.0, "a period must be positive"),
        (0.0, math.nan, "a period must be positive"),
        (math.nan, None, "must be a number"),
    ],
)
def test_wrong_times_are_refused(due_s: float, period_s: float | None, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        call(due_s, period_s)
