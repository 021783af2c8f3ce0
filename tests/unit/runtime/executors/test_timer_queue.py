"""The timetable of scheduled calls, on the steady clock."""

from __future__ import annotations

import math
from time import monotonic

import pytest

from composer.runtime.executors.timer_queue import ScheduledCall, Timetable


def call(due_s: float, period_s: float | None = None) -> ScheduledCall:
    return ScheduledCall(due_s, period_s, lambda: None)


def take_due(timetable: Timetable) -> list[ScheduledCall]:
    taken = []
    while timetable.next_due_s() <= monotonic():
        taken.append(timetable.take())
    return taken


def test_gives_what_is_due_in_order_and_keeps_the_rest() -> None:
    timetable = Timetable()
    now_s = monotonic()
    late, soon, later = call(now_s - 2.0), call(now_s - 1.0), call(now_s + 60.0)
    for item in (later, soon, late):
        timetable.add(item)
    assert timetable.next_s == late.due_s
    assert take_due(timetable) == [late, soon]
    assert take_due(timetable) == []
    assert timetable.next_due_s() == timetable.next_s == later.due_s


def test_calls_due_at_the_same_time_keep_their_order() -> None:
    timetable = Timetable()
    due_s = monotonic() - 1.0
    calls = [call(due_s) for _ in range(10)]
    for item in calls:
        timetable.add(item)
    assert take_due(timetable) == calls


def test_an_empty_timetable_is_never_due() -> None:
    timetable = Timetable()
    assert timetable.next_due_s() == timetable.next_s == math.inf
    assert take_due(timetable) == []


def test_a_cancelled_call_is_not_given_and_not_waited_for() -> None:
    timetable = Timetable()
    now_s = monotonic()
    due, next_one, last = call(now_s - 1.0), call(now_s + 30.0), call(now_s + 60.0)
    for item in (due, next_one, last):
        timetable.add(item)
    due.cancel()
    next_one.cancel()
    next_one.cancel()
    assert take_due(timetable) == []
    assert timetable.next_due_s() == last.due_s


def test_cancelled_calls_do_not_pile_up() -> None:
    timetable = Timetable()
    for _ in range(10_000):
        item = call(monotonic() + 60.0)
        timetable.add(item)
        item.cancel()
    assert len(timetable._entries) < 200


def test_a_periodic_call_keeps_its_beat_and_skips_what_it_missed() -> None:
    timetable = Timetable()
    begin_s = monotonic() - 350.0
    item = call(begin_s, period_s=100.0)
    timetable.repeat(item)  # called 3.5 periods late
    assert item.due_s == pytest.approx(begin_s + 400.0)
    assert timetable.next_s == item.due_s


def test_a_periodic_call_in_time_comes_a_period_later() -> None:
    timetable = Timetable()
    due_s = monotonic()
    item = call(due_s, period_s=60.0)
    timetable.repeat(item)
    assert item.due_s == pytest.approx(due_s + 60.0)


def test_a_call_that_is_out_counts_for_when_the_next_is_due() -> None:
    timetable = Timetable()
    begin_s = monotonic() - 1.0
    once, often = call(begin_s), call(begin_s + 0.5, period_s=60.0)
    timetable.add(once)
    timetable.add(often)
    assert timetable.take() is once
    assert timetable.next_s == often.due_s
    assert timetable.take() is often
    assert timetable.next_s == begin_s + 60.5
    timetable.add(call(begin_s + 30.0))
    assert timetable.next_s == begin_s + 30.0


@pytest.mark.parametrize("period_s", [None, 1.0])
def test_what_is_cancelled_or_once_only_is_not_repeated(period_s: float | None) -> None:
    timetable = Timetable()
    item = call(monotonic(), period_s)
    if period_s is not None:
        item.cancel()
    timetable.repeat(item)
    assert timetable.next_due_s() == math.inf


@pytest.mark.parametrize("period_s", [0.0, -1.0, math.nan])
def test_a_period_must_be_positive(period_s: float) -> None:
    with pytest.raises(ValueError, match="a period must be positive"):
        call(0.0, period_s)


def test_a_time_must_be_a_number() -> None:
    with pytest.raises(ValueError, match="must be a number"):
        call(math.nan)
