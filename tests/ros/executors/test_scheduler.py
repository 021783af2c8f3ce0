"""Properties of the composer's own loop only: fairness, no lost wake-ups, no leaks."""

from __future__ import annotations

import gc
import os
import threading
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import pytest
from rclpy.qos import HistoryPolicy
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger

from composer.model import ExecutorKind
from composer.runtime.executors import readiness
from composer.runtime.executors.futures import Future, done_event
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.readiness import EntitySource
from composer.runtime.executors.sources import SubscriptionSource
from tests.ros.support.in_process import wait_until
from tests.ros.support.loops import Bench, bench, peer


@pytest.fixture
def on() -> Iterator[Bench]:
    with bench(ExecutorKind.EVENTS) as running:
        yield running


def wait_for(loop: Loop, future: Future[Any], timeout_s: float | None = None) -> bool:
    """Wait for a future; return whether it is done."""
    loop.wait(done_event(future), timeout_s)
    return future.done()


@pytest.mark.parametrize("post", ["call_soon", "call_later in the past", "call_later at once"])
def test_a_call_that_posts_itself_starves_nothing(on: Bench, post: str) -> None:
    stop: list[bool] = []
    seen: list[int] = []
    ticks: list[int] = []

    def again() -> None:
        if stop:
            return
        if post == "call_soon":
            on.loop.call_soon(again)
        else:
            on.loop.call_later(-1.0 if "past" in post else 0.0, again)

    on.subscribe(Int64, "numbers", lambda message: seen.append(message.data))
    on.loop.call_every(0.005, lambda: ticks.append(1))
    on.loop.call_soon(again)
    publisher = on.node.create_publisher(Int64, "numbers", 10)
    publisher.publish(Int64(data=1))
    wait_until(lambda: seen and len(ticks) > 20)
    stop.append(True)


def test_a_full_queue_starves_no_other_subscription(on: Bench) -> None:
    flood: list[int] = []
    served_at: list[int] = []
    on.subscribe(Int64, "flood", lambda message: flood.append(1), history=HistoryPolicy.KEEP_ALL)
    on.subscribe(Int64, "rare", lambda message: served_at.append(len(flood)))
    floods = on.node.create_publisher(Int64, "flood", 2000)
    rare = on.node.create_publisher(Int64, "rare", 10)
    wait_until(lambda: floods.get_subscription_count() and rare.get_subscription_count())

    def publish_all() -> None:
        for number in range(2000):
            floods.publish(Int64(data=number))
        rare.publish(Int64(data=0))

    on.loop.run(publish_all, 60.0)
    wait_until(lambda: len(flood) == 2000)
    assert len(served_at) == 1
    assert served_at[0] < 200  # not after the two thousand


def test_a_response_behind_those_to_other_clients_is_taken_at_once(on: Bench) -> None:
    """A client receives all responses of its service, and a take skips those to others."""
    requests: list[Any] = []
    on.serve(Trigger, "ask", lambda _, reply: requests.append(reply))
    clients = [on.client(Trigger, "ask") for _ in range(2)]
    wait_until(lambda: all(client.service_is_ready() for client in clients))
    futures = []
    for client in (clients[0], clients[0], clients[0], clients[1]):
        futures.append(client.call_async(Trigger.Request()))
        wait_until(lambda: len(requests) == len(futures))
    answers_there = readiness.Signal()
    probe = on.node.create_client(Trigger, "ask")
    answers_there.attach(probe.handle, readiness.RESPONSE)
    seen: list[int] = []

    def answer_all() -> None:  # and block the loop until all of them have arrived
        for number, reply in enumerate(requests):
            reply(Trigger.Response(message=str(number)))
        until_s = time.monotonic() + 5.0
        while sum(seen) < len(requests) and time.monotonic() < until_s:
            seen.append(answers_there.count())

    on.loop.run(answer_all, 60.0)
    wait_until(lambda: all(future.done() for future in futures))
    assert [future.result().message for future in futures] == ["0", "1", "2", "3"]
    answers_there.close()
    on.node.destroy_client(probe)


class RaisingOnce(tuple[EntitySource, ...]):
    """Sources whose first iteration raises, as an asynchronous exception would."""

    has_raised = False

    def __iter__(self) -> Iterator[EntitySource]:
        if not self.has_raised:
            self.has_raised = True
            raise SystemExit
        return super().__iter__()


def test_an_exception_between_two_callbacks_loses_nothing(on: Bench) -> None:
    seen: list[int] = []
    subscription = on.node.create_subscription(Int64, "numbers", lambda _: None, 10)
    source = SubscriptionSource(subscription, lambda taken: seen.append(taken[0].data))
    group = on.loop.add_group(source)
    group.sources = RaisingOnce(group.sources)
    publisher = on.node.create_publisher(Int64, "numbers", 10)
    wait_until(publisher.get_subscription_count)

    def publish() -> None:
        for number in range(5):
            publisher.publish(Int64(data=number))

    on.loop.run(publish, 60.0)
    wait_until(lambda: seen == [0, 1, 2, 3, 4])
    assert on.errors() == [SystemExit]
    on.loop.remove_group(group)


def test_a_subscription_may_be_destroyed_before_it_is_removed_and_in_its_callback(
    on: Bench,
) -> None:
    """In the wrong order, the destruction is postponed until the loop releases the entity."""
    for _ in range(20):
        subscription = on.subscribe(Int64, "numbers", lambda message: None)
        publisher = on.node.create_publisher(Int64, "numbers", 10)
        on.node.destroy_subscription(subscription)
        publisher.publish(Int64(data=1))
        on.loop.run(lambda: None, 60.0)
        on.loop.remove(subscription)
        on.node.destroy_publisher(publisher)
    seen: list[int] = []

    def once(message: Int64) -> None:
        seen.append(message.data)
        on.loop.remove(own)
        on.node.destroy_subscription(own)

    own = on.subscribe(Int64, "own", once)
    publisher = on.node.create_publisher(Int64, "own", 10)

    def publish() -> None:
        for number in range(5):
            publisher.publish(Int64(data=number))

    on.loop.run(publish, 60.0)
    wait_until(lambda: seen)
    on.loop.run(lambda: None, 60.0)
    assert seen == [0]
    assert on.reports == []


def test_no_file_descriptor_leaks() -> None:
    def descriptors() -> int:
        return len(os.listdir("/proc/self/fd"))  # noqa: PTH208  a directory of links that vanish

    counts = []
    for _ in range(4):
        with bench(ExecutorKind.EVENTS) as on:
            for _ in range(10):
                kept = on.subscribe(String, "texts", lambda message: None)
                on.serve(Trigger, "ask", lambda request, reply: None)
                on.client(Trigger, "ask")
                on.loop.remove(kept)
        del on, kept
        gc.collect()
        counts.append(descriptors())
    wait_until(lambda: descriptors() <= counts[1])


def test_a_flood_of_another_process_neither_blocks_a_loop_nor_its_end(on: Bench) -> None:
    """With a Python callback on the middleware's thread it deadlocked within a second."""
    seen: list[int] = []
    on.subscribe(Int64, "flood", lambda message: seen.append(message.data), depth=10)
    with peer("flood", "flood", 10_000_000, 10):  # it never ends and is killed
        wait_until(lambda: seen and seen[-1] > 20_000 and len(seen) > 100, "twenty thousand")
        assert on.loop.run(lambda: "alive", 60.0) == "alive"
        assert on.loop.stop(60.0)
    assert seen == sorted(seen)
    assert on.reports == []


@pytest.mark.usefixtures("on")  # ROS
def test_a_failing_exception_handler_does_not_end_the_loop(
    capfd: pytest.CaptureFixture[str],
) -> None:
    def fall_over(*_: object) -> None:
        raise ValueError("broken")

    loop = Loop("loop", fall_over)
    loop.start()
    loop.call_soon(fall_over)
    assert loop.run(lambda: "alive", 60.0) == "alive"
    assert capfd.readouterr().err.count("ValueError: broken") >= 1
    assert loop.stop(60.0)


def test_each_wait_ends_with_its_future_and_keeps_nothing_else_waiting(
    on: Bench,
) -> None:
    outer: Future[None] = Future()
    inner: Future[None] = Future()
    order: list[str] = []

    def wait(name: str, future: Future[None]) -> None:
        assert wait_for(on.loop, future)
        assert on.loop.is_current()
        order.append(name)

    on.subscribe(Int64, "numbers", lambda _: order.append("received"))
    publisher = on.node.create_publisher(Int64, "numbers", 10)
    wait_until(lambda: publisher.get_subscription_count() == 1)
    on.loop.call_soon(lambda: wait("outer", outer))
    on.loop.call_soon(lambda: wait("inner", inner))
    on.loop.run(lambda: order.append("served"), 60.0)
    publisher.publish(Int64())
    wait_until(lambda: len(order) == 2)
    on.loop.call_soon(lambda: outer.set_result(None))
    wait_until(lambda: len(order) == 3)
    inner.set_result(None)  # from another thread
    wait_until(lambda: len(order) == 4)
    assert order == ["served", "received", "outer", "inner"]
    assert on.errors() == []


def test_another_thread_serves_the_loop_while_a_watched_call_blocks(on: Bench) -> None:
    released = threading.Event()
    ended: list[bool] = []
    threads: set[int] = set()

    def block() -> None:
        began = on.loop.begin_blocking(expected=len(threads) == 3)
        released.wait(5.0)
        ended.append(on.loop.end_blocking(began))

    def serves(number: int) -> bool:
        if number < 4:
            on.loop.hand_over_blocked()
        return len(threads) == number

    timer = on.loop.call_every(0.001, lambda: threads.add(threading.get_ident()))
    wait_until(lambda: serves(1))
    for number in (2, 3, 4):  # the last one is expected to block
        on.loop.call_soon(block)
        wait_until(partial(serves, number))
    assert ended == []
    released.set()
    wait_until(lambda: len(ended) == 3)
    assert sum(ended) >= 2  # the last one may have been too short
    timer.cancel()
    wait_until(lambda: not on.loop.busy_threads())
    assert on.loop.run(lambda: "served", 60.0) == "served"
    assert len(threads) == 4
    assert on.errors() == []


def test_a_timer_that_waits_longer_than_its_period_is_called_again_after_it(on: Bench) -> None:
    answered: Future[None] = Future()
    waits: list[bool] = []
    others: list[float] = []
    timer = on.loop.call_every(0.001, lambda: waits.append(wait_for(on.loop, answered, 5.0)))
    on.loop.call_every(0.002, lambda: others.append(time.monotonic()))
    wait_until(lambda: len(others) >= 10)
    assert waits == []
    answered.set_result(None)
    wait_until(lambda: len(waits) >= 3)
    timer.cancel()
    assert on.errors() == []


def test_a_wait_ends_in_time_and_when_the_loop_stops(on: Bench) -> None:
    never: Future[None] = Future()
    results: list[bool] = []
    on.loop.call_soon(lambda: results.append(wait_for(on.loop, never, 0.01)))
    wait_until(lambda: results)
    assert results == [False]
    waiting = threading.Event()
    on.loop.call_soon(lambda: (waiting.set(), results.append(wait_for(on.loop, never))))
    assert waiting.wait(60.0)
    assert on.loop.stop(60.0)
    assert results == [False, False]
