"""rclpy's action servers and clients on every kind of executor, to and from another process."""

from __future__ import annotations

import threading
import time
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from rcl_interfaces.srv import ListParameters
from rclpy.action import ActionClient, ActionServer
from rclpy.action.server import CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup

from composer.runtime.executors import actions
from composer.runtime.executors.tasks import sleep
from tests.ros.support.in_process import wait_until
from tests.ros.support.loops import Bench, peer, wait_for_line


class serving:  # noqa: N801
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
        time.sleep(0.002)
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
