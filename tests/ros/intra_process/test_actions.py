"""Actions between co-located nodes: in-process, with the same outcomes as by DDS."""

from __future__ import annotations

import gc
import threading
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from action_msgs.srv import CancelGoal
from rclpy.action.server import ServerGoalHandle

from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors import actions
from tests.ros.support.in_process import PATIENCE_S, Peer, RunningSystem, running, wait_until

TEXT = """
system: going
delivery: DELIVERY
executors: {own: {kind: KIND}}
nodes:
  server:
    behavior: going:Server
    executor: own
    action_servers: {go: {type: composer_interfaces/action/Navigate, reentrant: true}}
  client:
    behavior: going:Client
    action_clients: {go: {type: composer_interfaces/action/Navigate, timeout_ms: 20000}}
"""
MODULE = """
from composer.behavior import Behavior, BehaviorError
from composer_interfaces.action import Navigate

class Server(Behavior):
    def on_configure(self):
        self.goals = []
        self.feedback = []
        self.results = []
        self.turned_back = 0

    def accept_go(self, goal):
        return goal.max_velocity >= 0.0

    async def on_go(self, goal):
        self.goals.append(goal.request)
        step = 0
        while step < 3 or goal.request.max_velocity == 0.0:
            if goal.is_cancel_requested:
                self.turned_back += 1
                return Navigate.Result(message="turned back")
            self.feedback.append(Navigate.Feedback(progress_percent=float(step)))
            goal.publish_feedback(self.feedback[-1])
            step += 1
            await self.clock.sleep(0.001)
        self.results.append(Navigate.Result(success=True, message="arrived"))
        return self.results[-1]

class Client(Behavior):
    def on_configure(self):
        self.goals = []
        self.feedback = []
        self.results = []
        self.outcomes = []
        self.sent = None

    async def go(self, max_velocity):
        self.goals.append(Navigate.Goal(max_velocity=max_velocity))
        try:
            self.sent = await self.action_clients.go.send_goal(
                self.goals[-1], on_feedback=self.feedback.append
            )
            ended = await self.sent.result()
        except BehaviorError as error:
            self.outcomes.append(type(error).__name__)
        else:
            self.results.append(ended.result)
            self.outcomes.append((ended.status, ended.result.message))

    async def turn_back(self):
        assert await self.sent.cancel()
"""
COPIED = """
connections:
  - {action: /go, server: server.go, clients: client.go, isolation: copy}
"""


def text_of(delivery: str, kind: str = "events") -> str:
    """Return the system; with ``copy``, the connection requires copies."""
    text = TEXT.replace("KIND", kind)
    if delivery == "copy":
        return text.replace("DELIVERY", "auto") + COPIED
    return text.replace("DELIVERY", delivery)


def go(system: RunningSystem, max_velocity: float) -> Any:
    """Make the client send a goal and return its behavior; 0 m/s never arrives."""
    client = system.behavior("client")
    client.feedback.clear()
    client.sent = None
    system.spawn("client", client.go(max_velocity))
    return client


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
@pytest.mark.parametrize("delivery", ["auto", "copy", "dds"])
def test_goals_have_the_same_outcomes_in_process_and_by_dds(
    tmp_path: Path, kind: str, delivery: str
) -> None:
    with running(text_of(delivery, kind), tmp_path, going=MODULE) as system:
        server = system.behavior("server")
        client = go(system, 1.0)
        wait_until(lambda: client.outcomes)
        assert client.outcomes[-1] == ("succeeded", "arrived")
        assert [item.progress_percent for item in client.feedback] == [0.0, 1.0, 2.0]
        for there, here in (
            (server.goals, client.goals),
            (server.feedback, client.feedback),
            (server.results, client.results),
        ):
            assert there == here
            shared = [one is other for one, other in zip(there, here, strict=True)]
            assert shared == [delivery == "auto"] * len(here)

        go(system, -1.0)
        wait_until(lambda: len(client.outcomes) == 2)
        assert client.outcomes[-1] == "GoalRejected"

        go(system, 0.0)
        wait_until(lambda: client.feedback and client.sent)  # feedback may arrive first
        system.spawn("client", client.turn_back())
        wait_until(lambda: len(client.outcomes) == 3)
        assert client.outcomes[-1] == ("canceled", "turned back")

        go(system, 0.0)
        wait_until(lambda: client.feedback)
        system.change("server", "deactivate")
        wait_until(lambda: len(client.outcomes) == 4)
        assert client.outcomes[-1][0] == "canceled"  # whether the sleep ends first or not
        go(system, 1.0)
        wait_until(lambda: len(client.outcomes) == 5)
        assert client.outcomes[-1] == "GoalRejected"

        system.change("server", "activate")
        go(system, 0.0)
        wait_until(lambda: client.feedback)
        before = server.turned_back
        system.change("client", "deactivate")
        wait_until(lambda: len(client.outcomes) == 6)
        assert client.outcomes[-1] == "CallCancelled"
        wait_until(lambda: server.turned_back > before, "the end of the unawaited goal")


def test_a_goal_that_another_thread_runs_at_once_is_canceled_with_its_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spawn, may_go_on = NodeContext.spawn, threading.Event()

    def spawn_and_pause(context: NodeContext, coroutine: Any) -> Any:
        task = spawn(context, coroutine)
        if context.loop.name == "own":
            may_go_on.wait(PATIENCE_S)
        return task

    monkeypatch.setattr(NodeContext, "spawn", spawn_and_pause)
    with running(text_of("auto", "multi_threaded"), tmp_path, going=MODULE) as system:
        client = go(system, 0.0)
        wait_until(lambda: client.feedback and client.sent)
        system.spawn("client", client.turn_back())
        wait_until(lambda: system.behavior("server").turned_back)
        may_go_on.set()
        wait_until(lambda: client.outcomes)
        assert client.outcomes == [("canceled", "turned back")]


def count_goals() -> int:
    """Return how many goals of action servers are in memory."""
    gc.collect()
    return sum(type(item) is ServerGoalHandle for item in gc.get_objects())


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_the_results_of_ended_goals_are_not_kept(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(actions, "KEPT_STATUSES", 2)
    of_other_tests = count_goals()
    with running(text_of("auto", kind), tmp_path, going=MODULE) as system:
        outcomes = system.behavior("client").outcomes
        for count in range(1, 8):
            go(system, 1.0)
            wait_until(lambda count=count: len(outcomes) == count)
        wait_until(lambda: count_goals() <= of_other_tests + 2, "the end of the other goals")


def test_an_external_node_can_cancel_a_goal_of_the_process(tmp_path: Path) -> None:
    with running(text_of("auto"), tmp_path, going=MODULE) as system:
        client = go(system, 0.0)
        wait_until(lambda: client.feedback)
        with closing(Peer()) as peer:
            answer = peer.call(CancelGoal, "/go/_action/cancel_goal")  # all of them
        assert len(answer.goals_canceling) == 1
        wait_until(lambda: client.outcomes)
        assert client.outcomes == [("canceled", "turned back")]
