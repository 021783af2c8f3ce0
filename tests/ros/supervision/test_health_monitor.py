"""What the health monitor counts when the whole process is delayed."""

from __future__ import annotations

import pytest

from composer.runtime.supervision.health_monitor import CheckTime


@pytest.mark.parametrize(
    ("passed_s", "counted_s"), [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (2.5, 2.0), (3600.0, 2.0)]
)
def test_a_late_check_counts_at_most_as_two(passed_s: float, counted_s: float) -> None:
    """Otherwise every callback would hang after a pause of the computer."""
    time = CheckTime(period_s=1.0, now_s=10.0)
    began_s = time.advance(11.0)
    assert time.advance(11.0 + passed_s) - began_s == pytest.approx(counted_s)
    assert time.advance(12.0 + passed_s) - began_s == pytest.approx(counted_s + 1.0)
