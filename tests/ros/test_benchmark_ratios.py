"""What must not get lost again: how little we need, against rclpy in the same run.

The bounds leave room for a busy machine; ``make bench`` measures properly.
"""

from __future__ import annotations

import pytest

from benchmarks.figures import ratios
from benchmarks.systems import cpu_us
from benchmarks.turns import COMPOSED, SINGLE, Case, rows, take_turns

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(180)]


@pytest.mark.parametrize(
    ("shape", "nodes", "bound"),
    [
        pytest.param("ring", 10, 0.008, id="messages"),  # 0.003; by DDS it would be 0.015
        pytest.param("service", 3, 0.15, id="services"),  # 0.045
    ],
)
def test_cpu_stays_within_a_bound(shape: str, nodes: int, bound: float) -> None:
    case = Case(shape, nodes, seconds=0.3, rounds=1)
    (row,) = rows(shape, "CPU us", take_turns((COMPOSED, SINGLE), case), cpu_us)
    (ratio,) = ratios(row)
    assert ratio < bound, row
