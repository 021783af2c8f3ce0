"""Of large messages and fast topics, only some are read, whatever their type."""

from __future__ import annotations

import pytest

from composer.dashboard.observing.topics import (
    MAX_BYTES_PER_S,
    ByteLimit,
    large_profile,
)
from composer.model.qos import Durability, QosProfile, Reliability


@pytest.mark.parametrize("size", [100, 1_000_000, 50_000_000])
def test_the_bytes_per_second_are_limited(size: int) -> None:
    limit, read = ByteLimit(), 0
    for poll in range(1000):  # 10 s with 10 messages each 10 ms
        if limit.allows(100.0 + poll * 0.01):
            for _ in range(10):
                limit.count(size)
                read += size
    offered = 10_000 * size
    # A burst at the start, and what is read at once may exceed the limit until it is made up for.
    assert read == offered or 0.9 <= read / (10 * MAX_BYTES_PER_S) <= 1.1 + size / MAX_BYTES_PER_S
    assert (read == offered) == (size == 100)


def test_a_pause_does_not_add_up() -> None:
    limit = ByteLimit()
    assert limit.allows(0.0)
    assert limit.allows(1e6)
    limit.count(MAX_BYTES_PER_S)
    assert not limit.allows(1e6 + 0.5)
    assert limit.allows(1e6 + 1.0)


def test_large_messages_are_requested_so_that_nothing_waits_for_the_reader() -> None:
    profile = QosProfile(depth=200, reliability=Reliability.RELIABLE)
    large = large_profile(profile)
    assert (large.depth, large.reliability) == (5, Reliability.BEST_EFFORT)
    assert large_profile(large) == large
    kept = QosProfile(depth=1, durability=Durability.TRANSIENT_LOCAL)
    assert large_profile(kept) == kept
