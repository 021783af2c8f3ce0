"""Services and clients on every kind of executor, and the futures of rclpy that they return."""

from __future__ import annotations

import json
import warnings
from collections import deque
from collections.abc import Callable
from typing import Any

import pytest
from rclpy.task import Future as RclpyFuture
from std_srvs.srv import Trigger

from composer.runtime.executors.futures import Future, wrap_future
from composer.runtime.executors.strand import SerialStrand
from composer.runtime.executors.tasks import Task, sleep, within
from tests.ros.support.in_process import wait_until
from tests.ros.support.loops import Bench, last_line, peer

ERRORS = (ValueError, SystemExit, KeyboardInterrupt)


def call(on: Bench, client: Any, request: Any) -> Any:
    """Call from a task of the loop and wait for the response."""

    async def ask() -> Any:
        return await client.call_async(request)

    wait_until(client.service_is_ready)
    future = on.loop.run_task(ask())
    wait_until(future.done)
    return future.result()


def test_responses_may_be_sent_later_and_in_any_order(on: Bench) -> None:
    waiting: list[Any] = []

    def keep(request: Trigger.Request, reply: Any) -> None:
        waiting.append(reply)
        if len(waiting) == 3:
            on.loop.call_later(0.05, answer)

    def answer() -> None:
        for number, reply in reversed(list(enumerate(waiting))):
            reply(Trigger.Response(success=True, message=f"answer {number}"))

    on.serve(Trigger, "ask", keep)
    with peer("call", "ask", 3) as process:
        answers = json.loads(last_line(process))
    assert answers == [[True, f"answer {number}"] for number in range(3)]


def test_a_request_is_answered_once(on: Bench) -> None:
    replies: list[Any] = []
    on.serve(Trigger, "ask", lambda _, reply: replies.append(reply))
    client = on.client(Trigger, "ask")
    wait_until(client.service_is_ready)
    future = client.call_async(Trigger.Request())
    wait_until(lambda: replies)
    with pytest.raises(TypeError):
        replies[0]("nonsense")
    replies[0](Trigger.Response(success=True))
    with pytest.raises(RuntimeError, match="already answered"):
        replies[0](Trigger.Response())
    wait_until(future.done)
    assert future.result().success


def test_if_the_callback_raises_the_client_gets_a_response(on: Bench) -> None:
    errors = iter(ERRORS)

    def fall_over(request: Trigger.Request, reply: Any) -> None:
        raise next(errors)

    on.serve(Trigger, "ask", fall_over)
    client = on.client(Trigger, "ask")
    for _ in ERRORS:
        assert not call(on, client, Trigger.Request()).success
    # On several threads the response may be faster.
    wait_until(lambda: len(on.reports) == len(ERRORS))
    assert set(on.errors()) == set(ERRORS)
    assert all("service 'ask'" in what for what, _ in on.reports)


def test_a_call_without_a_response_is_forgotten_and_a_late_response_ignored(on: Bench) -> None:
    replies: list[Any] = []
    on.serve(Trigger, "ask", lambda _, reply: replies.append(reply))
    client = on.client(Trigger, "ask")
    wait_until(client.service_is_ready)

    async def ask() -> Any:
        answer = wrap_future(client.call_async(Trigger.Request()))
        return await within(on.loop, answer, 0.1)

    future = on.loop.run_task(ask())
    wait_until(future.done)
    with pytest.raises(TimeoutError):
        future.result()
    wait_until(lambda: not client._pending_requests)
    wait_until(lambda: len(replies) == 1)
    replies[0](Trigger.Response(success=True))
    second = client.call_async(Trigger.Request())
    wait_until(lambda: len(replies) == 2)
    replies[1](Trigger.Response(success=True, message="second"))
    wait_until(second.done)
    assert second.result().message == "second"
    assert on.reports == []


def test_an_exception_in_a_done_callback_is_reported(on: Bench) -> None:
    on.serve(Trigger, "ask", lambda _, reply: reply(Trigger.Response()))
    client = on.client(Trigger, "ask")
    wait_until(client.service_is_ready)

    def fall_over(_: object) -> None:
        raise ValueError("broken")

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        client.call_async(Trigger.Request()).add_done_callback(fall_over)
        wait_until(lambda: on.reports)
    assert on.errors() == [ValueError]
    assert "fall_over" in on.reports[0][0]


def test_a_service_that_was_not_added_uses_its_own_callback(on: Bench) -> None:
    def answer(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = "plain"
        return response

    async def answer_later(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        await sleep(on.loop, 0.01)
        response.message = "async"
        return response

    on.loop.remove_node(on.node)
    on.node.create_service(Trigger, "plain", answer)
    on.node.create_service(Trigger, "async", answer_later)
    on.loop.add_node(on.node)
    for name in ("plain", "async"):
        assert call(on, on.client(Trigger, name), Trigger.Request()).message == name


class Calls:
    is_parallel = False

    def __init__(self) -> None:
        self.waiting: deque[Callable[[], object]] = deque()
        self.called = 0

    def call_soon(self, callback: Callable[[], object]) -> None:
        self.waiting.append(callback)

    def overlap(self) -> None:
        raise AssertionError("a loop of one thread")

    def run(self) -> None:
        while self.waiting:
            self.called += 1
            self.waiting.popleft()()


def start(calls: Calls, awaited: Any, on_strand: bool = False) -> Future[Any]:
    async def inner() -> Any:
        return await awaited

    async def outer() -> Any:
        return await inner()

    def report(what: str, error: BaseException) -> None:
        raise error

    work = SerialStrand(calls).wrap(outer()) if on_strand else outer()
    future = Task(work, calls.call_soon, report, lambda _: None).start()
    calls.run()
    return future


@pytest.mark.parametrize("on_strand", [False, True])
def test_an_rclpy_future_is_not_polled(on_strand: bool) -> None:
    calls = Calls()
    foreign = RclpyFuture()
    outcome = start(calls, foreign, on_strand)
    called = calls.called
    calls.run()
    assert calls.called == called
    foreign.set_result("answer")
    calls.run()
    assert outcome.result() == "answer"
    if not on_strand:
        assert (called, calls.called) == (1, 2)


def test_an_rclpy_future_that_failed_raises_where_it_is_awaited() -> None:
    calls = Calls()
    foreign = RclpyFuture()
    outcome = start(calls, foreign)
    foreign.set_exception(ValueError("broken"))
    calls.run()
    with pytest.raises(ValueError, match="broken"):
        outcome.result()


def test_a_wrapped_future_has_the_outcome_of_the_rclpy_future_and_cancels_both_ways() -> None:
    foreign, failing, canceled, canceling = (RclpyFuture() for _ in range(4))
    future = wrap_future(foreign)
    assert not future.done()
    foreign.set_result("answer")
    assert future.result() == "answer"
    failed = wrap_future(failing)
    failing.set_exception(ValueError("broken"))
    assert isinstance(failed.exception(), ValueError)
    wrap_future(canceled).cancel()
    assert canceled.cancelled()
    future = wrap_future(canceling)
    canceling.cancel()
    assert future.cancelled()
