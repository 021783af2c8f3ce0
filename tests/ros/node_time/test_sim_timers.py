"""Timers in simulated time: in order, once each, whatever the clock does."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from functools import partial

import pytest

from composer.runtime.node_time import NANOSECONDS, SimTimers


class Loop:
    """A clock whose time the test sets."""

    def __init__(self) -> None:
        self.soon: deque[Callable[[], object]] = deque()

    def call_soon(self, callback: Callable[[], object]) -> None:
        self.soon.append(callback)

    def run(self) -> None:
        while self.soon:
            self.soon.popleft()()


class Bench:
    """A simulation that jumps between times, and the calls that it made."""

    def __init__(self) -> None:
        self.loop = Loop()
        self.calls = SimTimers(self.loop)
        self.called: list[float] = []

    def note(self) -> None:
        self.called.append(self.calls.now_ns / NANOSECONDS)

    def pass_to(self, *times_s: float) -> list[float]:
        """Set these times; return when calls were made."""
        self.called.clear()
        for time_s in times_s:
            self.calls.set_time(round(time_s * NANOSECONDS))
            self.loop.run()
        return list(self.called)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_timers_start_with_the_first_time(bench: Bench) -> None:
    bench.calls.add(0.1, bench.note, repeats=True)
    assert bench.pass_to(0.0, 0.0) == []
    assert bench.pass_to(1_700_000_000.0) == []
    assert bench.pass_to(1_700_000_000.1) == [1_700_000_000.1]


def test_multiples_of_a_period_are_met_exactly(bench: Bench) -> None:
    bench.pass_to(1_700_000_000.0)
    bench.calls.add(0.1, bench.note, repeats=True)
    start_ns = bench.calls.now_ns
    for step in range(1, 10_001):
        bench.calls.set_time(start_ns + step * 100_000_000)
        bench.loop.run()
    assert len(bench.called) == 10_000


JUMPS = [
    pytest.param(10.0, (110.5, 110.9, 111.0), [110.5, 111.0], id="forward: one call in phase"),
    pytest.param(100.0, (100.9, 100.5, 100.9, 100.6, 101.0), [101.0], id="a little backward"),
    pytest.param(100.0, (7.0, 7.9, 8.0, 9.0), [8.0, 9.0], id="backward: a period from there"),
]


@pytest.mark.parametrize(("start_s", "times_s", "called_s"), JUMPS)
def test_a_timer_follows_jumps(
    bench: Bench, start_s: float, times_s: tuple[float, ...], called_s: list[float]
) -> None:
    bench.pass_to(start_s)
    bench.calls.add(1.0, bench.note, repeats=True)
    assert bench.pass_to(*times_s) == called_s


def test_a_call_waits_its_delay_again_after_a_jump_backward(bench: Bench) -> None:
    bench.pass_to(100.0)
    bench.calls.add(1.0, bench.note, repeats=True)
    bench.calls.add(5.0, bench.note)
    assert bench.pass_to(7.0, 9.0, 11.9) == [9.0, 11.9]
    assert bench.pass_to(12.0) == [12.0, 12.0]


def test_a_pending_call_restarts_when_time_jumps_back(bench: Bench) -> None:
    bench.pass_to(100.0)

    def jump_back() -> None:
        bench.note()
        bench.calls.set_time(5 * NANOSECONDS)

    bench.calls.add(1.0, jump_back, repeats=True)
    assert bench.pass_to(101.0) == [101.0]
    assert bench.pass_to(5.9, 6.0) == [6.0]


def test_a_busy_loop_gets_no_call_twice(bench: Bench) -> None:
    bench.pass_to(1.0)
    bench.calls.add(0.1, bench.note, repeats=True)
    for tenth in range(11, 21):
        bench.calls.set_time(tenth * NANOSECONDS // 10)
    assert len(bench.loop.soon) == 1
    bench.loop.run()
    assert bench.called == [2.0]
    assert bench.pass_to(2.1) == [2.1]


def test_calls_come_in_the_order_they_are_due(bench: Bench) -> None:
    bench.pass_to(1.0)
    order: list[str] = []
    bench.calls.add(0.3, lambda: order.append("later"))
    for name in "abcde":
        bench.calls.add(0.1, partial(order.append, name))
    bench.pass_to(2.0)
    assert order == [*"abcde", "later"]


@pytest.mark.parametrize("repeats", [True, False])
def test_a_canceled_call_is_not_made(bench: Bench, repeats: bool) -> None:
    bench.pass_to(1.0)
    waiting = bench.calls.add(0.1, bench.note, repeats=repeats)
    handed_over = bench.calls.add(0.1, bench.note, repeats=repeats)
    waiting.cancel()
    waiting.cancel()
    bench.calls.set_time(2 * NANOSECONDS)
    handed_over.cancel()
    bench.loop.run()
    assert bench.pass_to(3.0) == []


def test_a_timer_that_raises_continues(bench: Bench) -> None:
    bench.pass_to(1.0)

    def fall_over() -> None:
        bench.note()
        raise RuntimeError("fell over")

    bench.calls.add(1.0, fall_over, repeats=True)
    with pytest.raises(RuntimeError, match="fell over"):
        bench.pass_to(2.0)
    with pytest.raises(RuntimeError, match="fell over"):
        bench.pass_to(3.0)
    assert bench.called == [3.0]


@pytest.mark.parametrize("delay_s", [0.0, -1.0, -math.inf])
def test_a_call_without_a_delay_is_made_while_time_is_paused(bench: Bench, delay_s: float) -> None:
    bench.calls.add(delay_s, bench.note)
    bench.loop.run()
    assert bench.called == [0.0]


@pytest.mark.parametrize("delay_s", [1e12, math.inf])
def test_a_delay_may_be_very_long(bench: Bench, delay_s: float) -> None:
    bench.calls.add(delay_s, bench.note)
    bench.calls.add(1.0, bench.note)
    assert bench.pass_to(1.0, 2.0, 1.5, 3.0) == [2.0]


def test_lateness_is_in_simulated_time(bench: Bench) -> None:
    bench.pass_to(1.0)
    late_s: list[float] = []
    call = bench.calls.add(1.0, lambda: late_s.append(call.late_s), repeats=True)
    bench.pass_to(2.25)
    assert late_s == [0.25]


@pytest.mark.parametrize(
    ("delay_s", "repeats", "message"),
    [
        (0.0, True, "a period must be positive"),
        (-1.0, True, "a period must be positive"),
        (math.nan, True, "a period must be positive"),
        (math.nan, False, "must be a number"),
    ],
)
def test_a_period_must_be_positive_and_a_delay_a_number(
    bench: Bench, delay_s: float, repeats: bool, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        bench.calls.add(delay_s, bench.note, repeats=repeats)
