"""Action servers and clients of hosted classes, and simulated time."""

from __future__ import annotations

from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate

from tests.ros.support.in_process import Peer, finished, running, wait_until
from tests.ros.support.simulator import Simulator

CLASSES = "tests.ros.support.node_classes"


@pytest.mark.parametrize("executor", ["kind: events", "kind: multi_threaded, threads: 3"])
def test_goals_are_executed_while_the_node_is_active_and_canceled_when_it_is_not(
    tmp_path: Path, peer: Peer, executor: str
) -> None:
    text = f"""
    system: goals
    executors: {{own: {{{executor}}}}}
    nodes:
      navigator:
        class: {CLASSES}:Navigator
        executor: own
        action_servers: {{navigate: {{type: composer_interfaces/action/Navigate, action: go}}}}
        remappings: {{navigate: go}}
      sender: {{class: "{CLASSES}:Sender", remappings: {{navigate: go}}}}
    """
    with running(text, tmp_path) as system:
        sender = system.node("sender").instance
        wait_until(lambda: sender.statuses)
        assert sender.statuses == [GoalStatus.STATUS_SUCCEEDED]
        assert sender.feedback == 3
        client = peer.action_client(Navigate, "/go")
        goal = Navigate.Goal()
        goal.target.x = 1000.0
        handle = finished(peer.run(lambda: client.send_goal_async(goal)))
        assert handle.accepted
        result = peer.run(handle.get_result_async)
        system.change("navigator", "deactivate")
        assert finished(result).status == GoalStatus.STATUS_CANCELED
        assert system.node("navigator").instance.canceled == 1
        assert not finished(peer.run(lambda: client.send_goal_async(goal))).accepted
        client.destroy()


def test_timers_of_a_class_follow_simulated_time(tmp_path: Path, peer: Peer) -> None:
    text = f"""
    system: simulated
    nodes:
      sampler:
        class: {CLASSES}:Sampler
        parameters: {{use_sim_time: {{type: bool, default: true}}}}
    """
    with running(text, tmp_path) as system:
        simulator, sampler = Simulator(peer, system), system.node("sampler").instance
        simulator.set_time(100.0, node="sampler")
        for tick in range(1, 7):
            simulator.set_time(100.0 + tick / 2, node="sampler")
            wait_until(lambda tick=tick: len(sampler.times) == tick)
    assert sampler.times == [100.5, 101.0, 101.5, 102.0, 102.5, 103.0]
