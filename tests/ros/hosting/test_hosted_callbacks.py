"""Callbacks and goals of hosted classes: they block, await, run in threads and in groups."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger

from tests.ros.support.in_process import Peer, end_limit_s, finished, running, wait_until
from tests.ros.support.simulator import Simulator

CLASSES = "tests.ros.support.callback_classes"
OTHERS = "tests.ros.support.node_classes"


def test_a_callback_may_block_until_another_node_responds(tmp_path: Path) -> None:
    text = f"""
    system: blocking
    executors: {{own: {{kind: multi_threaded}}}}
    nodes:
      listener: {{class: "{OTHERS}:Listener"}}
      caller: {{class: "{CLASSES}:BlockingCaller"}}
      other: {{class: "{CLASSES}:BlockingCaller", executor: own}}
    """
    with running(text, tmp_path) as system:
        callers = [system.node(name).instance for name in ("caller", "other")]
        wait_until(lambda: all(len(caller.responses) >= 6 for caller in callers))
        assert all(response.success for caller in callers for response in caller.responses)
        assert [caller.overlaps for caller in callers] == [0, 0]
        assert not any(node.errors for node in system.stop().nodes)


def test_a_callback_that_waits_for_a_response_is_released_when_its_node_is_deactivated(
    tmp_path: Path,
) -> None:
    text = f'system: alone\nnodes: {{caller: {{class: "{CLASSES}:BlockingCaller"}}}}'
    with running(text, tmp_path) as system:
        caller = system.node("caller").instance
        wait_until(lambda: caller.busy)
        system.change("caller", "deactivate")
        wait_until(lambda: not system.node("caller").loop.busy_threads())
        system.change("caller", "activate")
        wait_until(lambda: caller.busy)
        began_s = time.monotonic()
        outcome = system.stop()
        assert time.monotonic() - began_s < end_limit_s()
    assert outcome.nodes[0].errors == 0
    assert outcome.exit_code == 0


def test_coroutines_await_clients_and_keep_their_callback_groups(
    tmp_path: Path, peer: Peer
) -> None:
    text = f"""
    system: awaiting
    executors: {{pool: {{kind: multi_threaded, threads: 3}}}}
    nodes:
      listener: {{class: "{OTHERS}:Listener"}}
      caller: {{class: "{CLASSES}:AsyncCaller"}}
      timers: {{class: "{CLASSES}:AsyncTimers"}}
      groups: {{class: "{CLASSES}:Groups", executor: pool}}
    """
    with running(text, tmp_path) as system:
        response = peer.call(Trigger, "/relay")
        assert (response.success, response.message) == (True, "0")
        timers = system.node("timers").instance
        wait_until(lambda: timers.rounds >= 6)
        assert timers.overlaps == 0
        system.change("timers", "deactivate", "activate")
        wait_until(lambda: timers.rounds >= 10)
        # Callback groups exclude each other, also on several threads.
        peer.publisher(String, "/wait").publish(String())
        peer.publisher(String, "/finish").publish(String())
        wait_until(lambda: system.node("groups").instance.together == 1)


def test_a_thread_of_a_class_that_follows_rclpy_ends_with_the_instance(tmp_path: Path) -> None:
    names = ("Spinner", "Poller")
    nodes = ", ".join(f'{name}: {{class: "{OTHERS}:{name}"}}' for name in names)
    with running(f"system: threads\nnodes: {{{nodes}}}", tmp_path) as system:
        for name in names:
            thread = system.node(name).instance.thread
            sent = system.node(name).statistics
            wait_until(lambda sent=sent: sent.sent >= 3)
            assert thread.is_alive()
            system.change(name, "deactivate", "cleanup")
            wait_until(lambda thread=thread: not thread.is_alive())
        assert [node.errors for node in system.stop().nodes] == [0, 0]


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_a_callback_group_of_the_class_decides_when_its_callbacks_run(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    text = f"""
    system: throttled
    executors: {{own: {{kind: {kind}}}}}
    nodes: {{throttled: {{class: "{CLASSES}:Throttled", executor: own}}}}
    """
    with running(text, tmp_path) as system:
        node = system.node("throttled").instance
        numbers = peer.publisher(Int64, "/numbers")
        for number in range(5):
            numbers.publish(Int64(data=number))
        wait_until(lambda: node.group.tokens == 0 and len(node.group.ended) == 3)
        ticks = node.ticks
        wait_until(lambda: node.ticks > ticks + 10)  # another group
        expected = [f"number {number}" for number in range(5)]
        assert node.calls == expected[:3]
        node.group.tokens = 3
        assert not peer.call(Trigger, "/count").success
        wait_until(lambda: len(node.group.ended) == 6)
        assert sorted(node.calls) == ["count", *expected]
        assert [item for item in node.calls if item != "count"] == expected
        assert set(node.group.ended) == {node.numbers, node.service}
        counted = system.summary("/throttled")
    assert counted.errors == 0


@pytest.mark.parametrize("executor", ["kind: events", "kind: multi_threaded, threads: 3"])
def test_goals_are_executed_while_the_node_is_active_and_canceled_when_it_is_not(
    tmp_path: Path, peer: Peer, executor: str
) -> None:
    text = f"""
    system: goals
    executors: {{own: {{{executor}}}}}
    nodes:
      navigator:
        class: {OTHERS}:Navigator
        executor: own
        action_servers: {{navigate: {{type: composer_interfaces/action/Navigate, action: go}}}}
        remappings: {{navigate: go}}
      sender:
        class: {OTHERS}:Sender
        remappings: {{navigate: go}}
        lifecycle: {{depends_on: [navigator]}}
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


def test_a_class_may_destroy_its_action_server_and_create_it_again(tmp_path: Path) -> None:
    text = f"""
    system: goals
    nodes:
      navigator:
        class: {OTHERS}:Navigator
        action_servers: {{navigate: {{type: composer_interfaces/action/Navigate}}}}
      sender:
        class: {OTHERS}:Sender
        action_clients: {{navigate: {{type: composer_interfaces/action/Navigate}}}}
    """
    with running(text, tmp_path) as system:
        navigator, sender = (system.node(name).instance for name in ("navigator", "sender"))
        wait_until(lambda: sender.statuses)
        loop = system.node("navigator").loop
        loop.run(navigator.server.destroy)
        wait_until(lambda: not sender.client.server_is_ready())
        loop.run(navigator.serve)
        sender.timer.reset()
        wait_until(lambda: len(sender.statuses) == 2)
        assert sender.statuses == [GoalStatus.STATUS_SUCCEEDED] * 2
        assert not [line for line in system.log() if "is not declared" in line]


def test_timers_of_a_class_follow_simulated_time(tmp_path: Path, peer: Peer) -> None:
    text = f"""
    system: simulated
    nodes:
      sampler:
        class: {OTHERS}:Sampler
        parameters: {{use_sim_time: {{type: bool, default: true}}}}
    """
    with running(text, tmp_path) as system:
        simulator, sampler = Simulator(peer, system), system.node("sampler").instance
        simulator.set_time(100.0, node="sampler")
        for tick in range(1, 7):
            simulator.set_time(100.0 + tick / 2, node="sampler")
            wait_until(lambda tick=tick: len(sampler.times) == tick)
    assert sampler.times == [100.5, 101.0, 101.5, 102.0, 102.5, 103.0]
