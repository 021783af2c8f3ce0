"""Callbacks of hosted classes that block: others run meanwhile, and the system ends."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from composer_interfaces.action import Navigate
from std_msgs.msg import Int64
from std_srvs.srv import Trigger

from composer.runtime.host_options import HostOptions
from composer.runtime.supervision import health_monitor
from tests.ros.support.in_process import Peer, end_limit_s, finished, running, wait_until

CLASSES = "tests.ros.support.callback_classes"


@pytest.mark.parametrize("executor", ["kind: events", "kind: multi_threaded, threads: 4"])
def test_callbacks_sleep_at_a_rate_and_wait_for_their_own_subscription(
    tmp_path: Path, peer: Peer, executor: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(health_monitor, "BLOCKS_AFTER_S", 0.1)
    text = f"""
    system: sleeping
    executors: {{default: {{{executor}}}}}
    nodes: {{sleeper: {{class: "{CLASSES}:Sleeper"}}}}
    """
    with running(text, tmp_path) as system:
        sleeper = system.node("sleeper").instance
        wait_until(lambda: sleeper.rounds >= 2)
        call = peer.begin(Trigger, "/wait")
        wait_until(lambda: sleeper.rounds >= 4)
        assert not call.done()
        assert "callback_classes.py:" in system.wait_for_log("on_wait has not returned")
        peer.publisher(Int64, "/numbers").publish(Int64(data=1))
        assert finished(call).success
        assert system.log_text().count("on_wait has not returned") == 1
        counted = system.summary("/sleeper")
    assert counted.errors == 0


def test_goals_that_sleep_do_not_keep_the_system_from_ending(tmp_path: Path, peer: Peer) -> None:
    servers = {"plain": "is_async: false", "coroutine": "is_async: true", "long": "seconds: 600"}
    text = "system: sleeping\nnodes:\n"
    for name, arguments in servers.items():
        keys = f"arguments: {{{arguments}}}, remappings: {{navigate: {name}}}"
        text += f"  {name}: {{class: '{CLASSES}:SleepingServer', {keys}}}\n"
    with running(text, tmp_path, options=HostOptions(stop_within_s=2.0)) as system:
        for name in servers:
            client = peer.action_client(Navigate, f"/{name}")
            peer.run(lambda client=client: client.send_goal_async(Navigate.Goal()))
            wait_until(lambda name=name: system.node(name).instance.goals)
        began_s = time.monotonic()
        outcome = system.stop()
        assert time.monotonic() - began_s < end_limit_s() + 2.0
    assert outcome.exit_code == 0
    assert [(node.state, node.errors) for node in outcome.nodes] == [("finalized", 0)] * 3
    interrupted = [line for line in system.log() if "is interrupted; it is at" in line]
    assert len(interrupted) == len(servers)
    assert all("callback_classes.py:" in line for line in interrupted)


def test_tasks_of_an_executor_block_as_callbacks_do(
    tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(health_monitor, "BLOCKS_AFTER_S", 0.1)
    text = f'system: working\nnodes: {{tasks: {{class: "{CLASSES}:Tasks"}}}}'
    options = HostOptions(stop_within_s=5.0)  # on_done blocks until it is interrupted
    with running(text, tmp_path, options=options) as system:
        call = peer.begin(Trigger, "/wait")
        for name in ("plain", "awaits"):
            assert "callback_classes.py:" in system.wait_for_log(f"{name} has not returned")
        peer.publisher(Int64, "/numbers").publish(Int64(data=1))
        assert finished(call).success
        assert system.node("tasks").instance.results == ["a", "bc", "d", "no"]
        system.wait_for_log("on_done has not returned")
        outcome = system.stop()
    assert [(node.state, node.errors) for node in outcome.nodes] == [("finalized", 1)]
    assert "on_done is interrupted; it is at" in system.log_text()


DECLARED = """
        publishers: {stopped: {type: std_msgs/msg/Int64, qos: command, external: true}}
        subscriptions: {numbers: {type: std_msgs/msg/Int64, qos: command}}
"""


@pytest.mark.parametrize("declared", ["", DECLARED])
def test_a_constructor_waits_for_nodes_that_it_depends_on(
    tmp_path: Path, peer: Peer, declared: str
) -> None:
    text = f"""
    system: waiting
    nodes:
      listener: {{class: "tests.ros.support.node_classes:Listener"}}
      source:
        publishers: {{numbers: {{type: std_msgs/msg/Int64, qos: command, external: true}}}}
        timers: {{tick: {{period_ms: 10, publish: {{numbers: {{data: "{{count}}"}}}}}}}}
      waiter:
        class: {CLASSES}:Waiter
        lifecycle: {{depends_on: [source, listener]}}
        {declared}
    """
    with running(text, tmp_path) as system:
        waiter = system.node("waiter").instance
        assert waiter.waited_for < waiter.numbers[0] < waiter.numbers[1]
        assert waiter.response.success
        wait_until(lambda: waiter.awaited >= 2)
        stopped = peer.listen(Int64, "/stopped")
        wait_until(waiter.publisher.get_subscription_count)
        system.change("waiter", "deactivate", "cleanup")
        wait_until(lambda: [message.data for message in stopped] == [15])
        counted = system.summary("/waiter")
    assert counted.errors == 0
    assert "has not created" not in system.log_text()


def test_a_class_gets_matches_before_the_activation_and_in_the_process(
    tmp_path: Path, peer: Peer
) -> None:
    text = f"""
    system: matching
    nodes:
      matched:
        class: {CLASSES}:Matched
        publishers: {{out: {{type: std_msgs/msg/Int64, qos: command}}}}
      reader: {{subscriptions: {{out: {{type: std_msgs/msg/Int64, qos: command}}}}}}
    """
    with running(text, tmp_path) as system:
        matched = system.node("matched").instance
        wait_until(lambda: matched.matches == [("publisher", 1)])
        peer.publisher(Int64, "/in")
        wait_until(lambda: matched.matches[1:] == [("subscription", 1)])
        system.change("matched", "deactivate", "activate")
        peer.node.create_subscription(Int64, "out", print, 10)
        wait_until(lambda: matched.matches[2:] == [("publisher", 2)])


def test_nothing_is_lost_while_callbacks_of_all_kinds_block(tmp_path: Path) -> None:
    text = f'system: busy\nnodes: {{busy: {{class: "{CLASSES}:Busy"}}}}'
    with running(text, tmp_path) as system:
        busy = system.node("busy").instance
        for _ in range(4):
            calls, naps, numbers = busy.calls, busy.naps, len(busy.numbers)
            wait_until(lambda: busy.calls > calls + 10, "calls")  # noqa: B023
            wait_until(lambda: busy.naps > naps + 10, "naps")  # noqa: B023
            wait_until(lambda: len(busy.numbers) > numbers + 100, "numbers")  # noqa: B023
        received = tuple(busy.numbers)
        counted = system.summary("/busy")
    assert received == tuple(range(received[0], received[0] + len(received)))
    assert busy.overlaps == 0
    assert counted.errors == 0
