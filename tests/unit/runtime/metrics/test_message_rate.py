"""Rates of messages, and the limit on repeated log lines, which are counted."""

from __future__ import annotations

import pytest

from composer.runtime.clock import COMPUTER, RealClock
from composer.runtime.metrics.figures import CountedRate, MessageRate
from composer.runtime.metrics.repeat_limit import RepeatLimit


@pytest.mark.parametrize(
    ("times_s", "expected_hz"),
    [
        ([], None),
        ([5.0], None),
        ([5.0, 5.0004], None),  # a burst, without the next one
        ([5.0, 5.0004, 6.0], 2.0),
        ([5.0, 5.0004, 6.0, 6.0004], 2.0),
        ([5.0, 5.0004, 10.0, 10.0004, 15.0], 0.4),
        ([5.0, 6.0, 7.0, 8.0], 1.0),
        ([5.0 + number / 100 for number in range(300)], 100.0),
        ([5.0 + number / 12 for number in range(36)], 12.0),
        ([5.0, 5.5, 5.2], 2.0),  # two publishers with different clocks
    ],
)
def test_a_rate_counts_from_burst_to_burst(times_s: list[float], expected_hz: float | None) -> None:
    rate = MessageRate()
    for at_s in times_s:
        rate.add(at_s, 10)
        rate.forget_before(at_s - 3.0)
    assert rate.hertz == (None if expected_hz is None else pytest.approx(expected_hz, rel=0.02))
    assert rate.mean_bytes == (10.0 if times_s else None)


def test_a_rate_includes_missed_messages() -> None:
    rate = MessageRate()
    for second in range(4):  # of 1000 messages each second, the first one is late, and 99 are read
        for number in range(99):
            missed = 901 if number == 0 and second > 0 else 0
            rate.add(second + number / 1000, missed=missed)
    assert rate.hertz == pytest.approx(1000.0)


@pytest.mark.parametrize(
    ("readings", "expected_hz"),
    [
        ([(0, 10.0)], None),
        ([(0, 10.0), (5, 11.0)], None),  # since when is not known
        ([(0, 10.0), (0, 13.5)], 0.0),
        ([(0, 10.0), (2, 10.5), (2, 12.0), (6, 12.5)], 2.0),  # two at once, each second
        ([(0, 10.0), (2, 10.5), (4, 11.5), (4, 15.0)], 0.0),  # they have stopped
        ([(7, 10.0), (37, 11.0), (67, 12.0), (97, 13.0)], 30.0),
        ([(0, 10.0), (1, 10.0), (2, 20.0), (2, 29.0)], 0.1),
        ([(0, 10.0), (20, 11.0), (40, 12.0), (3, 13.0)], None),  # it counts from zero again
    ],
)
def test_a_counter_has_a_rate_from_change_to_change(
    readings: list[tuple[int, float]], expected_hz: float | None
) -> None:
    rate = CountedRate()
    for count, at_s in readings:
        rate.read(count, at_s)
    hertz = rate.current_hz(readings[-1][1])
    assert hertz == (None if expected_hz is None else pytest.approx(expected_hz))


class SetClock(RealClock):
    now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


def test_one_line_per_subject_and_period_and_a_limited_number_of_subjects() -> None:
    clock = SetClock()
    limit = RepeatLimit(clock, period_s=1.0)
    first = limit.admit("a")
    assert first is not None
    assert (first.is_first, first.suffix) == (True, "")
    assert limit.admit("a") is limit.admit("a") is None
    clock.now_s += 1.0
    again = limit.admit("a")
    assert again is not None
    assert (again.is_first, again.suffix) == (False, " (2 more since the last message)")
    clock.now_s += 1.0
    assert (limit.admit("a") or first).suffix == ""
    admitted = [limit.admit(f"subject {number}") for number in range(3000)]
    assert sum(item is not None for item in admitted) == 1000, "999 subjects, and all others"
    clock.now_s += 1.0
    admitted = [limit.admit(f"new {number}") for number in range(1000)]
    assert all(item is not None for item in admitted), "the others are forgotten"


def test_a_line_may_cause_another_one_at_any_moment() -> None:
    """As garbage collection does, if it finds an exception that was never retrieved."""
    limit = RepeatLimit(COMPUTER)

    class Subject(str):
        __slots__ = ()

        def __hash__(self) -> int:
            limit.admit("garbage")
            return super().__hash__()

    assert limit.admit(Subject("line")) is not None
    assert limit.admit("garbage") is None
