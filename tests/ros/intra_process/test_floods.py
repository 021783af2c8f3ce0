"""More messages than a subscription handles: those within its depth arrive, the rest is counted."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from std_msgs.msg import Int64

from composer.runtime.executors.scheduler import Scheduler
from tests.ros.support.counting import MODULE, NUMBERS, numbers, send
from tests.ros.support.in_process import running, wait_until


@pytest.mark.parametrize(
    ("history", "sent", "kept"),
    [("depth: 1", 1000, 1), ("depth: 500", 1000, 500), ("history: keep_all", 5000, 5000)],
)
def test_a_flood_keeps_messages_within_the_depth_and_counts_the_rest(
    tmp_path: Path, history: str, sent: int, kept: int
) -> None:
    text = NUMBERS.replace("KIND", "events").replace("depth: 100", history)
    with running(text, tmp_path, counting=MODULE) as system:
        send(system, sent)
        near = system.behavior("near")
        wait_until(lambda: len(near.received) == kept)
        assert numbers(near.received) == list(range(sent - kept, sent))
        assert system.node("near").statistics.dropped == sent - kept


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
@pytest.mark.parametrize("depth", [1, 500])
def test_concurrent_publishers_lose_no_message_uncounted(
    tmp_path: Path, kind: str, depth: int
) -> None:
    text = NUMBERS.replace("KIND", kind).replace("100", str(depth))
    with running(text, tmp_path, counting=MODULE) as system:
        far, publish = system.node("far"), system.behavior("source").publishers.numbers

        def write(first: int) -> None:
            for number in range(first, first + 5000):
                publish.publish(Int64(data=number))

        writers = [threading.Thread(target=write, args=(k * 5000,)) for k in range(4)]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        wait_until(lambda: len(system.behavior("far").received) + far.statistics.dropped == 20_000)
        received = numbers(system.behavior("far").received)
        for k in range(4):
            from_one = [number for number in received if number // 5000 == k]
            assert from_one == sorted(from_one)
        assert {number % 5000 for number in received} & {4999}  # the last one arrives


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_a_flood_neither_fills_the_loop_nor_delays_later_messages(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    call_soon, loops = Scheduler.call_soon, list[Scheduler]()

    def counted(loop: Scheduler, callback: Callable[[], object]) -> None:
        loops.append(loop)
        call_soon(loop, callback)

    monkeypatch.setattr(Scheduler, "call_soon", counted)
    with running(NUMBERS.replace("KIND", kind), tmp_path, counting=MODULE) as system:
        far, release = system.node("far"), threading.Event()
        for _ in range(8):  # one per possible thread
            far.loop.call_soon(release.wait)
        before = loops.count(far.loop)
        for _ in range(20):
            send(system, 500)  # from the thread of another loop
        assert loops.count(far.loop) - before < 120  # its depth, and few other calls
        release.set()
        wait_until(lambda: len(system.behavior("far").received) + far.statistics.dropped == 10_000)
        assert numbers(system.behavior("far").received)[-100:] == list(range(9_900, 10_000))
        for number in range(10_000, 10_003):
            send(system, 1)
            wait_until(lambda n=number: numbers(system.behavior("far").received)[-1] == n)
