"""Services, actions and their clients on executors, and the futures of rclpy that they return."""

from __future__ import annotations

import json
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from rcl_interfaces.srv import ListParameters
from rclpy.action import ActionClient, ActionServer
from rclpy.action.server import CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future as RclpyFuture
from std_srvs.srv import Trigger

from composer.runtime.executors import actions
from composer.runtime.executors.futures import Future, wrap_future
from composer.runtime.executors.strand import SerialStrand
from composer.runtime.executors.tasks import Task, sleep, within
from tests.ros.support.in_process import wait_until
from tests.ros.support.loops import Bench, last_line, peer, wait_for_line

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


class serving:  # noqa: N801 - used like a function
    """An action server that takes three steps, or continues forever if it is slow."""

    def __init__(self, on: Bench, **options: Any) -> None:
        self.on = on
        callbacks: dict[str, Any] = {
            "execute_callback": self.execute,
            "goal_callback": self.accept,
            "cancel_callback": lambda _: CancelResponse.ACCEPT,
            "callback_group": ReentrantCallbackGroup(),
            **options,
        }
        self.server = ActionServer(on.node, Navigate, "navigate", **callbacks)
        on.loop.add_action_server(self.server)

    def accept(self, goal: Navigate.Goal) -> GoalResponse:
        return GoalResponse.ACCEPT if goal.max_velocity > 0 else GoalResponse.REJECT

    async def execute(self, goal: Any) -> Navigate.Result:
        for step in range(3 if goal.request.max_velocity >= 1.0 else 10_000):
            if goal.is_cancel_requested:
                goal.canceled()
                return Navigate.Result(message="canceled")
            goal.publish_feedback(Navigate.Feedback(progress_percent=float(step)))
            await sleep(self.on.loop, 0.01)
        goal.succeed()
        return Navigate.Result(success=True, message="arrived")

    def __enter__(self) -> ActionServer:
        return self.server

    def __exit__(self, *_: object) -> None:
        self.on.loop.remove(self.server)
        self.server.destroy()


def own_client(on: Bench) -> ActionClient:
    client = ActionClient(on.node, Navigate, "navigate", callback_group=ReentrantCallbackGroup())
    on.loop.add_action_client(client)
    wait_until(client.server_is_ready)
    return client


def wait_for(future: Any) -> Any:
    wait_until(future.done)
    return future.result()


def test_destroying_a_client_while_the_loop_polls_it_is_not_an_error(on: Bench) -> None:
    """rclpy adds it to its wait set although it is destroyed."""
    client = ActionClient(on.node, Navigate, "nowhere", callback_group=ReentrantCallbackGroup())
    on.loop.add_action_client(client)
    client._client_handle.destroy_when_not_in_use()  # the first step of destroy
    for _ in range(3):
        on.loop.run(lambda: None)
    on.loop.remove(client)
    client.destroy()
    assert on.errors() == []


def test_an_early_response_waits_until_its_request_is_registered(
    on: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """rclpy registers a request after sending it, in several steps."""
    monkeypatch.setattr(actions, "LAST_RETRY_AFTER_S", 60.0)
    has_come = threading.Event()
    call = actions.ActionSource.call

    def watched(source: actions.ActionSource, taken: Any) -> None:
        call(source, taken)
        if source.may_skip:  # the source of the client, not of the server
            has_come.set()

    monkeypatch.setattr(actions.ActionSource, "call", watched)
    with serving(on):
        client = own_client(on)

        def add_late(future: Any) -> None:
            has_come.wait(60.0)
            ActionClient.add_future(client, future)

        monkeypatch.setattr(client, "add_future", add_late)
        assert not wait_for(client.send_goal_async(Navigate.Goal(max_velocity=0.0))).accepted
        wait_until(lambda: not client._futures, "nothing is left")
        on.loop.remove(client)
        client.destroy()
    assert on.reports == []


def answers(asking: Any) -> bool:
    """Return whether responses of a server arrive: it may discover this process later."""
    future = asking.call_async(ListParameters.Request())
    until = time.monotonic() + 1.0
    while not future.done() and time.monotonic() < until:
        time.sleep(0.002)  # poll: rclpy's futures have no wait
    return bool(future.done())


def test_a_client_gets_acceptance_feedback_and_result_of_another_process_and_cancels(
    on: Bench,
) -> None:
    with peer("navigate", "navigate") as process:
        wait_for_line(process, "serving")
        client = own_client(on)
        # Discovered in order: with this one, all entities of the client are known.
        last = on.client(ListParameters, f"peer_{process.pid}/list_parameters")
        wait_until(last.service_is_ready)
        wait_until(lambda: answers(last), "the server knows of the client")
        seen: list[float] = []
        handle = wait_for(
            client.send_goal_async(
                Navigate.Goal(max_velocity=1.0),
                feedback_callback=lambda message: seen.append(message.feedback.progress_percent),
            )
        )
        assert handle.accepted
        end = wait_for(handle.get_result_async())
        assert end.status == GoalStatus.STATUS_SUCCEEDED
        assert end.result.message == "arrived"
        wait_until(lambda: seen == [0.0, 1.0, 2.0])

        feedback = threading.Event()
        handle = wait_for(
            client.send_goal_async(
                Navigate.Goal(max_velocity=0.1), feedback_callback=lambda _: feedback.set()
            )
        )
        # Otherwise rclpy's server loses a goal that is canceled just before it executes.
        wait_until(feedback.is_set, "the goal runs")
        result = handle.get_result_async()
        assert len(wait_for(handle.cancel_goal_async()).goals_canceling) == 1
        assert wait_for(result).status == GoalStatus.STATUS_CANCELED
        on.loop.remove(client)
        client.destroy()
    assert on.reports == []
