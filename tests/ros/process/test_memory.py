"""Memory does not grow under a load of messages, timers and lifecycle transitions."""

from __future__ import annotations

import os

import pytest

from benchmarks.processes import run_program
from benchmarks.soak import after_fifths

#: A leak of one byte per message would be 8 MB, and of 16 bytes 2.6 MB in the short version.
GROWTH_MB = 2.0


@pytest.mark.parametrize(
    "share", [0.02, pytest.param(1.0, marks=[pytest.mark.soak, pytest.mark.timeout(900)])]
)
def test_memory_is_flat_after_the_first_fifth(share: float) -> None:
    figures = run_program(
        "soak",
        "--share",
        str(share),
        timeout_s=50.0 if share < 1.0 else 880.0,
        variables=os.environ,  # the ROS domain of this test
    )
    assert figures["messages"] >= share * 10_000_000
    first_mb, *later_mb = after_fifths(figures["memory_mb"])
    assert max(later_mb) - first_mb < GROWTH_MB, figures["memory_mb"]
