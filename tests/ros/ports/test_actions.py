"""Action servers and clients of a running node, from goal to result, with all outcomes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus, GoalStatusArray
from composer_interfaces.action import Navigate
from rclpy.qos import qos_profile_action_status_default

from composer.runtime.executors import actions
from composer.runtime.supervision.events import Logged
from tests.ros.support.in_process import Peer, finished, running, wait_until

SERVER = """
system: server
executors: {shared: {kind: KIND}}
nodes:
  server:
    executor: shared
    action_servers:
      navigate:
        type: composer_interfaces/action/Navigate
        external: true
        accept: goal.max_velocity > 0.0
        log: "goal to {goal.target.x}"
        feedback:
          count: 4
          period_ms: 5
          message:
            progress_percent: "{(count + 1) * 25.0}"
            current_position: {x: "{goal.target.x}"}
        result: {success: true, message: "arrived at {goal.target.x}"}
"""
KINDS = ["events", "multi_threaded"]


class Navigator:
    """A hand-written client."""

    def __init__(self, peer: Peer, name: str = "/navigate") -> None:
        self._peer = peer
        self.feedback: list[float] = []
        self.client = peer.action_client(Navigate, name)

    def send(self, x: float = 1.0, max_velocity: float = 1.0) -> Any:
        goal = Navigate.Goal(max_velocity=max_velocity)
        goal.target.x = x
        take = self._take
        return self._answer(lambda: self.client.send_goal_async(goal, feedback_callback=take))

    def result(self, handle: Any) -> tuple[int, Navigate.Result]:
        answer = self._answer(handle.get_result_async)
        return answer.status, answer.result

    def cancel(self, handle: Any) -> Any:
        return self._answer(handle.cancel_goal_async)

    def _answer(self, ask: Callable[[], Any]) -> Any:
        """Send on the thread that takes responses: rclpy drops those to unregistered requests."""
        return finished(self._peer.run(ask))

    def _take(self, message: Any) -> None:
        self.feedback.append(message.feedback.progress_percent)


@pytest.mark.parametrize("kind", KINDS)
def test_a_declared_action_gives_feedback_and_results_and_rejects_goals(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    with running(SERVER.replace("KIND", kind), tmp_path) as system:
        navigator = Navigator(peer)
        server = system.ros_node("server")
        wait_until(
            lambda: server.count_subscribers("/navigate/_action/feedback"),
            "the feedback subscription",
        )
        handle = navigator.send(3.0)
        # After the result, rclpy's client drops feedback that it has not taken.
        wait_until(lambda: len(navigator.feedback) == 4, "all feedback")
        status, result = navigator.result(handle)
        assert system.log() == ["goal to 3.0"]
        assert not navigator.send(max_velocity=0.0).accepted
        system.wait_for_log("rejects a goal: it does not fulfill 'accept'")
        assert peer.change("/server", "deactivate")
        assert not navigator.send().accepted
        system.wait_for_log("rejects a goal: /server is inactive, not active")
        assert peer.change("/server", "activate")
        assert navigator.send().accepted
    assert status == GoalStatus.STATUS_SUCCEEDED
    assert (result.success, result.message) == (True, "arrived at 3.0")
    assert navigator.feedback[:4] == [25.0, 50.0, 75.0, 100.0]


HANDLED = """
system: handled
executors: {shared: {kind: KIND}}
nodes:
  handled:
    executor: shared
    behavior: handled:Handled
    action_servers:
      navigate: {type: composer_interfaces/action/Navigate, external: true}
"""
REENTRANT = """
      overlap: {type: composer_interfaces/action/Navigate, external: true, reentrant: true}
"""
PATIENT = """
from composer.behavior import Behavior
from composer_interfaces.action import Navigate

class Handled(Behavior):
    def accept_navigate(self, request):
        return request.target.x < 100.0

    async def on_navigate(self, goal):
        self.log.info(f"begin {goal.request.target.x}")
        while not goal.is_cancel_requested:
            await self.clock.sleep(0.002)
        self.log.info(f"end {goal.request.target.x}")
        return Navigate.Result(message="stopped")

    on_overlap = on_navigate
"""


def handled(kind: str = "events") -> str:
    return HANDLED.replace("KIND", kind)


@pytest.mark.parametrize("kind", KINDS)
def test_goals_run_one_at_a_time_unless_reentrant_and_end_when_canceled_or_deactivated(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    canceled = GoalStatus.STATUS_CANCELED
    text = handled(kind) + REENTRANT.lstrip("\n")
    with running(text, tmp_path, handled=PATIENT) as system:
        navigator, overlapping = Navigator(peer), Navigator(peer, "/overlap")
        for number in (11.0, 12.0):
            assert overlapping.send(number).accepted
        for number in (11.0, 12.0):
            system.wait_for_log(f"begin {number}")
        assert not navigator.send(100.0).accepted
        first, second, third = (navigator.send(float(number)) for number in (1, 2, 3))
        system.wait_for_log("begin 1.0")
        navigator.cancel(second)  # which waits
        assert navigator.result(second)[0] == canceled
        assert "begin 3.0" not in system.log_text()
        assert len(navigator.cancel(first).goals_canceling) == 1
        status, result = navigator.result(first)
        assert (status, result.message) == (canceled, "stopped")
        system.wait_for_log("begin 3.0")
        waiting = navigator.send(4.0)
        assert peer.change("/handled", "deactivate")
        assert peer.state("/handled") == "inactive"
        assert [navigator.result(goal)[0] for goal in (third, waiting)] == [canceled] * 2
        counted = system.summary("/handled")
    assert "begin 2.0" not in system.log_text()
    assert counted.errors == 0
    assert system.end().exit_code == 0


INSTANT = """
from composer.behavior import Behavior
from composer_interfaces.action import Navigate

class Handled(Behavior):
    def on_navigate(self, goal):
        return Navigate.Result(message=str(goal.request.target.x))
"""


@pytest.mark.parametrize("kind", KINDS)
def test_few_ended_goals_are_kept(
    tmp_path: Path, peer: Peer, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(actions, "KEPT_STATUSES", 2)
    monkeypatch.setattr(actions, "KEPT_RESULTS", 3)
    with running(handled(kind), tmp_path, handled=INSTANT):
        statuses = peer.listen(
            GoalStatusArray, "/navigate/_action/status", qos_profile_action_status_default
        )
        navigator = Navigator(peer)
        handles = [navigator.send(float(number)) for number in range(10)]
        outcomes = [navigator.result(handle) for handle in handles]
        wait_until(lambda: statuses, "a list of goals")
    # On several threads, the next goal may be accepted before the last one has left the list.
    assert max(len(item.status_list) for item in statuses) <= 5
    assert [result.message for _, result in outcomes[-3:]] == ["7.0", "8.0", "9.0"]
    assert {status for status, _ in outcomes[:4]} == {GoalStatus.STATUS_UNKNOWN}


def test_a_handler_that_does_not_end_its_goal_is_canceled(tmp_path: Path, peer: Peer) -> None:
    module = """
    from composer.behavior import Behavior, CallCancelled

    class Handled(Behavior):
        async def on_navigate(self, goal):
            self.log.info("begin")
            while True:
                try:
                    await self.clock.sleep(0.01)
                except CallCancelled:
                    await never(self)

    async def never(behavior):
        from composer.runtime.executors.futures import Future
        await Future()
    """
    with running(handled(), tmp_path, handled=module) as system:
        navigator = Navigator(peer)
        handle = navigator.send()
        system.wait_for_log("begin")
        assert peer.change("/handled", "deactivate")
        assert navigator.result(handle)[0] == GoalStatus.STATUS_CANCELED
        assert peer.change("/handled", "cleanup")
    assert "action server 'navigate': a goal did not end within 1 s, canceled" in system.log()


WAYS_OUT = [
    ("raise ValueError('no way')", GoalStatus.STATUS_ABORTED, "ValueError: no way"),
    ("raise SystemExit(1)", GoalStatus.STATUS_ABORTED, "SystemExit: 1"),
    ("return 'nonsense'", GoalStatus.STATUS_ABORTED, "not a Navigate.Result"),
    ("return None", GoalStatus.STATUS_SUCCEEDED, ""),
    ("goal.abort()", GoalStatus.STATUS_ABORTED, ""),
    ("goal.canceled()", GoalStatus.STATUS_CANCELED, ""),
    ("goal.succeed(); goal.succeed()", GoalStatus.STATUS_SUCCEEDED, "on_navigate"),
    ("goal.publish_feedback('nonsense')", GoalStatus.STATUS_ABORTED, "TypeError"),
]


@pytest.mark.parametrize("prefix", ["", "async "])
def test_every_outcome_of_a_handler_ends_the_goal(tmp_path: Path, peer: Peer, prefix: str) -> None:
    """An action for each of them: repeated errors of one handler are not logged at once."""
    text = "system: outcomes\nnodes:\n  handled:\n    behavior: handled:Handled\n"
    text += "    action_servers:\n"
    module = "from composer.behavior import Behavior\n\nclass Handled(Behavior):\n"
    for number, (body, _, _) in enumerate(WAYS_OUT):
        text += (
            f"      go_{number}: {{type: composer_interfaces/action/Navigate, external: true}}\n"
        )
        module += f"    {prefix}def on_go_{number}(self, goal):\n        {body}\n"
    with running(text, tmp_path, handled=module) as system:
        for number, (body, status, fault) in enumerate(WAYS_OUT):
            navigator = Navigator(peer, f"/go_{number}")
            assert navigator.result(navigator.send())[0] == status, body
            system.wait_for_log(fault.replace("on_navigate", f"on_go_{number}"))
        counted = system.summary("/handled")
    assert counted.errors == sum(fault != "" for _, _, fault in WAYS_OUT)


CLIENT = """
system: client
nodes:
  server:
    behavior: handled:Handled
    action_servers:
      navigate: {type: composer_interfaces/action/Navigate, external: true}
"""
CLIENT_NODE = """
  client_NUMBER:
    lifecycle: {depends_on: [server]}
    action_clients:
      navigate:
        type: composer_interfaces/action/Navigate
        timeout_ms: 20000
        on_feedback: {log: "feedback {feedback.progress_percent} of {goal.target.x}"}
        on_result: {log: "{status}: {result.message}"}
        on_failure: {log: "failed: {failure}"}
    timers:
      send: {period_ms: 20, when: count == 0, call: {navigate: {target: {x: TARGET}}}}
"""
REACTING = """
from composer.behavior import Behavior
from composer_interfaces.action import Navigate

class Handled(Behavior):
    def accept_navigate(self, request):
        return request.target.x < 100.0

    async def on_navigate(self, goal):
        goal.publish_feedback(Navigate.Feedback(progress_percent=50.0))
        await self.clock.sleep(0.05)
        if goal.request.target.x < 0.0:
            goal.abort()
            return Navigate.Result()
        return Navigate.Result(message="done")
"""
#: The logs of clients by their targets.
REACTIONS = {
    "1.0": ["feedback 50.0 of 1.0", "succeeded: done"],
    "-1.0": ["feedback 50.0 of -1.0", "aborted: "],
    "100.0": ["failed: action '/navigate' rejected the goal"],
}


def with_clients(*targets: str) -> str:
    return CLIENT + "".join(
        CLIENT_NODE.replace("NUMBER", str(number)).replace("TARGET", target)
        for number, target in enumerate(targets)
    )


def test_the_reactions_of_an_action_client(tmp_path: Path) -> None:
    with running(with_clients(*REACTIONS), tmp_path, handled=REACTING) as system:
        for lines in REACTIONS.values():
            system.wait_for_log(lines[-1])
    for number, lines in enumerate(REACTIONS.values()):
        logged = system.reported(Logged)
        assert [item.message for item in logged if item.logger == f"client_{number}"] == lines


def test_goals_are_canceled_when_their_client_leaves_active(tmp_path: Path, peer: Peer) -> None:
    with running(with_clients("1.0"), tmp_path, handled=PATIENT) as system:
        system.wait_for_log("begin 1.0")
        assert peer.change("/client_0", "deactivate")
        system.wait_for_log("end 1.0")
        assert peer.state("/server") == "active"
        assert system.summary("/client_0").errors == 0
