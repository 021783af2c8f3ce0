"""The memory of a flight recorder is limited, whatever the clock of the computer does."""

from __future__ import annotations

import tracemalloc

import pytest

pytest.importorskip("mcap")

from composer.bags.bag import BagMessage, BagTopic
from composer.bags.ring import Ring

LIMIT_BYTES = 1_000_000


@pytest.mark.parametrize("size", [1, 10_000])
def test_a_clock_that_is_set_back(monkeypatch: pytest.MonkeyPatch, size: int) -> None:
    """No message is old then, and small messages take more memory than their bytes."""
    monkeypatch.setattr("composer.bags.ring.LARGEST_BYTES", LIMIT_BYTES)
    ring = Ring(seconds=10.0)
    ring.add_topic(BagTopic("/chat", "std_msgs/msg/String"))
    tracemalloc.start()
    try:
        for number in range(20_000):
            ring.write(BagMessage("/chat", 10**18 - number, 10**18 - number, bytes(size)))
        used_bytes, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert used_bytes < 1.5 * LIMIT_BYTES
