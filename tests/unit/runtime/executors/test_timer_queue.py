"""The queue of scheduled calls, on the steady clock."""

from __future__ import annotations

import gc
import math
from time import monotonic

import pytest

from composer.runtime.clock.clock import COMPUTER
from composer.runtime.executors.base_loop import ScheduledCall, TimerQueue


def call(due_s: float, period_s: float | None = None) -> ScheduledCall:
    return ScheduledCall(COMPUTER.monotonic, due_s, period_s, lambda: None)


def take_due(queue: TimerQueue[ScheduledCall]) -> list[ScheduledCall]:
    taken = []
    while queue.next_due_s() <= monotonic():
        taken.append(queue.pop())
    return taken


def test_pops_due_calls_in_order_and_keeps_the_rest() -> None:
    queue = TimerQueue[ScheduledCall](COMPUTER.monotonic)
    now_s = monotonic()
    late, soon, later = call(now_s - 2.0), call(now_s - 1.0), call(now_s + 60.0)
    for item in (later, soon, late):
        queue.add(item)
    assert queue.next_s == late.due_s
    assert take_due(queue) == [late, soon]
    assert take_due(queue) == []
    assert queue.next_due_s() == queue.next_s == later.due_s


def test_calls_due_at_the_same_time_keep_their_order() -> None:
    queue = TimerQueue[ScheduledCall](COMPUTER.monotonic)
    due_s = monotonic() - 1.0
    calls = [call(due_s) for _ in range(10)]
    for item in calls:
        queue.add(item)
    assert take_due(queue) == calls


def test_an_empty_queue_is_never_due() -> None:
    queue = TimerQueue[ScheduledCall](COMPUTER.monotonic)
    assert queue.next_due_s() == queue.next_s == math.inf
    assert take_due(queue) == []


def test_a_canceled_call_is_neither_made_nor_waited_for() -> None:
    queue = TimerQueue[ScheduledCall](COMPUTER.monotonic)
    now_s = monotonic()
    due, next_one, last = call(now_s - 1.0), call(now_s + 30.0), call(now_s + 60.0)
    for item in (due, next_one, last):
        queue.add(item)
    due.cancel()
    next_one.cancel()
    next_one.cancel()
    assert take_due(queue) == []
    assert queue.next_due_s() == last.due_s


def test_canceled_calls_do_not_accumulate() -> None:
    def count() -> int:
        gc.collect()
        return sum(type(item) is ScheduledCall for item in gc.get_objects())

    queue, before = TimerQueue[ScheduledCall](COMPUTER.monotonic), count()
    for _ in range(10_000):
        item = call(monotonic() + 60.0)
        queue.add(item)
        item.cancel()
    assert count() < before + 200


def test_a_periodic_call_keeps_its_phase_and_skips_missed_periods() -> None:
    queue = TimerQueue[ScheduledCall](COMPUTER.monotonic)
    begin_s = monotonic() - 350.0
    item = call(begin_s, period_s=100.0)
    queue.reschedule(item)  # called 3.5 periods late
    assert item.due_s == pytest.approx(begin_s + 400.0)
    assert queue.next_s == item.due_s


def test_a_periodic_call_in_time_is_due_one_period_later() -> None:
    queue = TimerQueue[ScheduledCall](COMPUTER.monotonic)
    due_s = monotonic()
    item = call(due_s, period_s=60.0)
    queue.reschedule(item)
    assert item.due_s == pytest.approx(due_s + 60.0)


def test_a_popped_call_counts_for_the_next_due_time() -> None:
    queue = TimerQueue[ScheduledCall](COMPUTER.monotonic)
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


@pytest.mark.parametrize("period_s", [None, 1.0])
def test_canceled_and_single_calls_are_not_repeated(period_s: float | None) -> None:
    queue = TimerQueue[ScheduledCall](COMPUTER.monotonic)
    item = call(monotonic(), period_s)
    if period_s is not None:
        item.cancel()
    queue.reschedule(item)
    assert queue.next_due_s() == math.inf


@pytest.mark.parametrize("period_s", [0.0, -1.0, math.nan])
def test_a_period_must_be_positive(period_s: float) -> None:
    with pytest.raises(ValueError, match="a period must be positive"):
        call(0.0, period_s)


def test_a_time_must_be_a_number() -> None:
    with pytest.raises(ValueError, match="must be a number"):
        call(math.nan)
