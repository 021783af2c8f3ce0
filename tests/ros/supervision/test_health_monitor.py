"""What the health monitor counts when the whole process is delayed."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

from composer.runtime.clock.clock import COMPUTER
from composer.runtime.supervision.health_monitor import HealthMonitor, _ObservedCallback


@pytest.mark.parametrize(
    ("passed_s", "counted_s"), [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (2.5, 2.0), (3600.0, 2.0)]
)
def test_a_late_check_counts_at_most_as_two(passed_s: float, counted_s: float) -> None:
    """Otherwise every callback would hang after a pause of the computer."""
    node_set = SimpleNamespace(nodes={}, loops={}, hung=set())
    context: Any = SimpleNamespace(node_set=node_set, clock=COMPUTER)
    monitor = HealthMonitor(context)
    assert monitor._period_s == 1.0
    now_s = time.monotonic()
    monitor._forgive_delay(now_s)
    callback: Any = None
    observed = _ObservedCallback(callback, "own", now_s, interrupted_s=now_s)
    monitor._callbacks = {callback: observed}
    monitor._forgive_delay(now_s + passed_s)
    assert observed.interrupted_s is not None
    for since_s in (observed.since_s, observed.interrupted_s):
        assert now_s + passed_s - since_s == pytest.approx(counted_s)
