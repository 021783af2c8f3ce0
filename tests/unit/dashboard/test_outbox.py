"""What waits for a browser, and what is read for it, stays within bounds; drops are counted."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.dashboard.observing.topics import MAX_BYTES_PER_S, ByteLimit, large_profile
from composer.dashboard.protocol.outbox import (
    CONNECTION_BYTES,
    MAX_BATCHES,
    Delivery,
    Outbox,
    Update,
)
from composer.model.qos import Durability, QosProfile, Reliability


def next_message(outbox: Outbox) -> str | bytes:
    """Return the next message, which must be there already: then no event loop is needed."""
    coroutine = outbox.next()
    with pytest.raises(StopIteration) as ended:
        coroutine.send(None)
    message: str | bytes = ended.value.value
    return message


def received(outbox: Outbox) -> dict[str, Any]:
    """Return the next message, which must be a text."""
    message = next_message(outbox)
    assert isinstance(message, str)
    content: dict[str, Any] = json.loads(message)
    return content


def test_a_state_is_replaced_by_a_newer_one() -> None:
    outbox = Outbox()
    outbox.open(1, "nodes", Delivery.LATEST)
    for number in range(100):
        outbox.put(1, Update(str(number)))
    expected = {"sub": 1, "seq": 0, "dropped": 99, "channel": "nodes", "data": 99}
    assert received(outbox) == expected
    assert outbox.budget.used == 0


def test_messages_wait_in_order_and_the_oldest_are_dropped() -> None:
    outbox = Outbox()
    outbox.open(1, "echo", Delivery.QUEUE)
    for number in range(MAX_BATCHES + 2):
        outbox.put(1, Update(str(number), count=10, dropped=1))
    found = [received(outbox) for _ in range(MAX_BATCHES)]
    assert [message["data"] for message in found] == list(range(2, MAX_BATCHES + 2))
    assert found[-1]["dropped"] == 2 * 10 + MAX_BATCHES + 2
    assert [message["seq"] for message in found] == list(range(MAX_BATCHES))


def test_replies_come_first_and_subscriptions_take_turns_until_they_are_closed() -> None:
    outbox = Outbox()
    for number in (1, 2, 3):
        outbox.open(number, "echo", Delivery.QUEUE)
        outbox.put(number, Update('"first"'))
        outbox.put(number, Update('"second"'))
    outbox.close(3)
    outbox.put(3, Update('"third"'))
    outbox.reply('{"id": 7}')
    assert received(outbox) == {"id": 7}
    order = [(message["sub"], message["data"]) for message in map(received, [outbox] * 4)]
    assert order == [(1, "first"), (2, "first"), (1, "second"), (2, "second")]
    assert outbox.budget.used == 0


def test_a_picture_has_its_header_in_front() -> None:
    outbox = Outbox()
    outbox.open(3, "image", Delivery.LATEST)
    outbox.put(3, Update(b"pixels", header='{"encoding":"png"}'))
    message = next_message(outbox)
    assert isinstance(message, bytes)
    length = int.from_bytes(message[:4], "big")
    header = json.loads(message[4 : 4 + length])
    assert header == {"sub": 3, "seq": 0, "dropped": 0, "encoding": "png"}
    assert message[4 + length :] == b"pixels"


@given(
    st.lists(
        st.tuples(st.integers(1, 5), st.integers(0, CONNECTION_BYTES // 3), st.booleans()),
        max_size=60,
    )
)
def test_the_size_has_a_limit_and_every_message_is_counted(
    updates: list[tuple[int, int, bool]],
) -> None:
    outbox = Outbox()
    for number in range(1, 6):
        outbox.open(number, "echo", Delivery.QUEUE if number % 2 else Delivery.LATEST)
    content = bytes(CONNECTION_BYTES // 3)
    put, taken = 0, 0
    for number, size, is_taken in updates:
        outbox.put(number, Update(content[:size], header="{}"))
        put += 1
        assert outbox.budget.used <= CONNECTION_BYTES
        if is_taken and outbox.budget.used:
            next_message(outbox)
            taken += 1
    while outbox.budget.used:
        next_message(outbox)
        taken += 1
    assert put == taken + sum(outbox.dropped(number) for number in range(1, 6))


def test_replies_that_are_not_read_are_limited_in_bytes() -> None:
    outbox = Outbox()
    for _ in range(20):
        outbox.reply("x" * 1_000_000)
    assert outbox.is_full_of_replies
    assert outbox.budget.used <= CONNECTION_BYTES


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
