"""Topics on every kind of executor, to and from another process."""

from __future__ import annotations

import threading
import time

from rclpy.qos import HistoryPolicy
from std_msgs.msg import Int64

from tests.ros.support.in_process import wait_until
from tests.ros.support.loops import Bench, last_line, peer


def test_messages_from_before_the_subscription_was_added_are_served(on: Bench) -> None:
    arrived = on.loop.run(lambda: _publish_before_adding(on), 60.0)
    wait_until(lambda: len(arrived) == 3)
    assert arrived == [0, 1, 2]


def _publish_before_adding(on: Bench) -> list[int]:
    """Run on the loop, which serves nothing meanwhile."""
    arrived: list[int] = []
    publisher = on.node.create_publisher(Int64, "early", 10)
    subscription = on.node.create_subscription(Int64, "early", lambda _: None, 10)
    wait_until(publisher.get_subscription_count)
    for number in range(3):
        publisher.publish(Int64(data=number))
    on.loop.add_subscription(subscription, lambda taken: arrived.append(taken[0].data))
    return arrived


def test_keep_all_loses_no_message_of_a_burst(on: Bench) -> None:
    seen: list[int] = []
    on.subscribe(
        Int64, "burst", lambda message: seen.append(message.data), history=HistoryPolicy.KEEP_ALL
    )
    with peer("flood", "burst", 3000, 3000):
        wait_until(lambda: len(seen) == 3000)
    assert sorted(seen) == list(range(3000))


def test_an_exception_in_a_callback_is_reported_and_the_next_message_arrives(on: Bench) -> None:
    errors = (ValueError, SystemExit, KeyboardInterrupt)
    seen: list[int] = []

    def fall_over(message: Int64) -> None:
        seen.append(message.data)
        raise errors[message.data]

    on.subscribe(Int64, "numbers", fall_over)
    publisher = on.node.create_publisher(Int64, "numbers", 10)
    for number in range(3):
        publisher.publish(Int64(data=number))
        wait_until(lambda number=number: len(on.reports) == number + 1)
    assert seen == [0, 1, 2]
    assert on.errors() == list(errors)
    assert all("'numbers'" in what and "fall_over" in what for what, _ in on.reports)


def test_after_removal_no_message_arrives(on: Bench) -> None:
    seen: list[int] = []
    subscription = on.subscribe(Int64, "numbers", lambda message: seen.append(message.data))
    kept: list[int] = []
    on.subscribe(Int64, "numbers", lambda message: kept.append(message.data))
    publisher = on.node.create_publisher(Int64, "numbers", 10)
    publisher.publish(Int64(data=1))
    wait_until(lambda: seen and kept)
    on.loop.remove(subscription)
    on.loop.remove(subscription)  # harmless
    on.loop.run(lambda: None, 60.0)
    publisher.publish(Int64(data=2))
    wait_until(lambda: len(kept) == 2)
    assert seen == [1]
    on.node.destroy_subscription(subscription)


def test_a_slow_subscription_does_not_delay_a_timer(on: Bench) -> None:
    """A flood of messages, each of them slow, against a timer of 100 Hz."""
    flood: list[int] = []
    ticks: list[int] = []

    def work(message: Int64) -> None:
        flood.append(message.data)
        time.sleep(0.001)

    on.subscribe(Int64, "flood", work, depth=5000)
    on.loop.call_every(0.01, lambda: ticks.append(1))
    with peer("flood", "flood", 1500, 5000):
        wait_until(lambda: len(flood) > 10)
        before = len(ticks)
        wait_until(lambda: len(flood) > 1000)
        meanwhile = len(ticks) - before
    # Of about a hundred during a thousand messages of a millisecond, however fast the machine is.
    assert meanwhile > 20


def test_entities_are_created_and_destroyed_during_a_flood(on: Bench) -> None:
    """Created, added, removed and destroyed on other threads while messages arrive."""
    stop = threading.Event()
    total: list[int] = []

    def churn() -> None:
        while not stop.is_set():
            created = [
                on.subscribe(Int64, "flood", lambda message: total.append(message.data))
                for _ in range(3)
            ]
            time.sleep(0.003)
            for subscription in created:
                on.loop.remove(subscription)
                on.node.destroy_subscription(subscription)

    with peer("flood", "flood", 20_000, 10) as process:
        steady: list[int] = []
        on.subscribe(Int64, "flood", lambda message: steady.append(message.data))
        threads = [threading.Thread(target=churn) for _ in range(2)]
        for thread in threads:
            thread.start()
        try:
            last_line(process)
        finally:
            stop.set()
            for thread in threads:
                thread.join()
    assert on.loop.run(lambda: "alive", 60.0) == "alive"
    wait_until(lambda: steady)
    assert on.reports == []
