"""Repeated log lines are limited, and counted."""

from __future__ import annotations

import pytest

from composer.runtime.clock.clock import COMPUTER, RealClock
from composer.runtime.metrics.repeat_limit import RepeatLimit


class SetClock(RealClock):
    now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> SetClock:
    return SetClock()


def test_one_line_per_subject_and_period(clock: SetClock) -> None:
    limit = RepeatLimit(clock, period_s=1.0)
    first = limit.admit("a")
    assert first is not None
    assert (first.is_first, first.suffix) == (True, "")
    assert limit.admit("a") is limit.admit("a") is None
    assert limit.admit("b") is not None
    clock.now_s += 1.0
    again = limit.admit("a")
    assert again is not None
    assert (again.is_first, again.suffix) == (False, " (2 more since the last message)")
    clock.now_s += 1.0
    assert (limit.admit("a") or first).suffix == ""


def test_the_number_of_subjects_is_limited(clock: SetClock) -> None:
    limit = RepeatLimit(clock, period_s=1.0)
    admitted = [limit.admit(f"subject {number}") for number in range(3000)]
    assert sum(item is not None for item in admitted) == 1001, "1000 subjects, and all others"
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
