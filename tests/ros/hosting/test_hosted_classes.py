"""Unmodified rclpy node classes as nodes of a system: what they send, receive and call."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String
from std_srvs.srv import SetBool, Trigger

from composer.runtime.supervision.events import Logged
from tests.ros.support.in_process import Peer, end_limit_s, running, wait_until
from tests.ros.support.node_classes import LATCHED

CLASSES = "tests.ros.support.node_classes"
TALKER_AND_LISTENER = f"""
system: pair
nodes:
  talker:
    class: {CLASSES}:Talker
    publishers: {{numbers: {{type: std_msgs/msg/Int64}}}}
  listener:
    class: {CLASSES}:Listener
    subscriptions: {{numbers: {{type: std_msgs/msg/Int64}}}}
"""


def test_messages_between_hosted_classes_stay_in_the_process(tmp_path: Path) -> None:
    with running(TALKER_AND_LISTENER, tmp_path) as system:
        talker, listener = system.node("talker").instance, system.node("listener").instance
        wait_until(lambda: len(listener.numbers) >= 5 and len(listener.infos) >= 5)
        assert listener.numbers[:5] == [1, 2, 3, 4, 5]
        assert [number for number, _ in listener.infos[:5]] == [1, 2, 3, 4, 5]
        publisher = system.node("talker")._entities._by_entity[talker.publisher][0]
        assert not publisher.gated._has_external
        counted = system.summary("/listener")
    assert counted.errors == 0
    assert counted.received >= 10
    line = "publisher on /talker/words is not declared: it uses DDS (std_msgs/msg/String)"
    assert line in system.log()


def test_a_message_object_that_is_published_again_arrives_as_it_was(
    tmp_path: Path, peer: Peer
) -> None:
    text = f"""
    system: reuse
    nodes:
      reuser:
        class: {CLASSES}:Reuser
        publishers: {{numbers: {{type: std_msgs/msg/Int64}}}}
      listener:
        class: {CLASSES}:Listener
        subscriptions: {{numbers: {{type: std_msgs/msg/Int64}}}}
    """
    with running(text, tmp_path) as system:
        peer.publisher(String, "/go").publish(String())
        listener = system.node("listener").instance
        wait_until(lambda: len(listener.numbers) == 3)
        assert listener.numbers == [1, 2, 3]


def test_external_nodes_see_an_ordinary_node(tmp_path: Path, peer: Peer) -> None:
    with running(TALKER_AND_LISTENER, tmp_path) as system:
        numbers = peer.listen(Int64, "/numbers")
        wait_until(lambda: len(numbers) >= 3)
        assert peer.call(Trigger, "/count").success
        wait_until(lambda: peer.node.count_services("/talker/get_parameters") == 1)
        names = peer.node.get_node_names_and_namespaces()
        assert names.count(("talker", "/")) == 1
        assert peer.node.count_services("/talker/change_state") == 1
        assert peer.set_parameter("/talker", "word", "changed") == ""
        words = peer.listen(String, "/talker/words")
        wait_until(lambda: words and words[-1].data == "message changed")
        assert system.node("talker").state == "active"


def test_several_instances_have_their_own_names_and_parameters(tmp_path: Path, peer: Peer) -> None:
    text = f"""
    system: many
    nodes:
      front:
        class: {CLASSES}:Talker
        namespace: robot
        remappings: {{numbers: /all/numbers, ~/words: spoken}}
        arguments: {{prefix: front}}
        parameters: {{word: {{type: string, default: left}}}}
      rear:
        class: {CLASSES}:Talker
        arguments: {{prefix: rear}}
    """
    with running(text, tmp_path) as system:
        spoken = peer.listen(String, "/robot/spoken")
        rear = peer.listen(String, "/rear/words")
        wait_until(lambda: spoken and rear)
        assert spoken[0].data == "front left"
        assert rear[0].data == "rear hello"
        assert peer.node.count_publishers("/all/numbers") == 1
        front = system.node("front").instance
        assert front.get_fully_qualified_name() == "/robot/front"
        assert front.resolve_topic_name("numbers") == "/all/numbers"


def test_connections_name_the_topics_of_a_class(tmp_path: Path) -> None:
    text = TALKER_AND_LISTENER + (
        "connections:\n  - {topic: /renamed, from: talker.numbers, to: [listener.numbers]}\n"
    )
    with running(text, tmp_path) as system:
        assert system.node("talker").instance.publisher.topic_name == "/renamed"
        wait_until(lambda: system.node("listener").instance.numbers)


def test_nothing_passes_while_inactive_and_latched_messages_are_sent_on_activation(
    tmp_path: Path, peer: Peer
) -> None:
    text = f"""
    system: quiet
    nodes:
      announcer: {{class: "{CLASSES}:Announcer", lifecycle: {{autostart: inactive}}}}
      talker: {{class: "{CLASSES}:Talker", lifecycle: {{autostart: inactive}}}}
      listener: {{class: "{CLASSES}:Listener", lifecycle: {{autostart: inactive}}}}
    """
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    with running(text, tmp_path) as system:
        numbers, maps = peer.listen(Int64, "/numbers"), peer.listen(String, "/map", latched)
        listener = system.node("listener").instance
        source = peer.publisher(Int64, "/numbers")
        source.publish(Int64(data=7))
        wait_until(lambda: system.node("listener").statistics.dropped == 2)
        refused = peer.call(Trigger, "/count")
        assert (refused.success, refused.message) == (False, "/listener is inactive, not active")
        system.node("talker").instance.tick()  # as a thread of the class may do
        assert numbers == [message for message in numbers if message.data == 7]
        assert (maps, listener.numbers, system.node("talker").instance.count) == ([], [], 1)
        for name in ("announcer", "talker"):
            system.change(name, "activate")
        wait_until(lambda: maps and any(message.data == 2 for message in numbers))
        assert [message.data for message in maps] == ["the map"]
        system.change("talker", "deactivate")
        count = system.node("talker").instance.count
        system.change("listener", "activate", "deactivate")
        assert system.node("talker").instance.count == count


@pytest.mark.parametrize("executor", [None, "events", "multi_threaded"])
def test_a_callback_may_block_until_another_node_responds(
    tmp_path: Path, executor: str | None
) -> None:
    kind = "" if executor is None else f"executors: {{own: {{kind: {executor}}}}}"
    chosen = "" if executor is None else "executor: own"
    text = f"""
    system: blocking
    {kind}
    nodes:
      listener: {{class: "{CLASSES}:Listener"}}
      caller:
        class: {CLASSES}:BlockingCaller
        {chosen}
    """
    with running(text, tmp_path) as system:
        caller = system.node("caller").instance
        wait_until(lambda: len(caller.responses) >= 6)
        assert all(response.success for response in caller.responses)
        assert caller.overlaps == 0
        counted = system.summary("/caller")
    assert counted.errors == 0


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


def test_coroutines_await_clients(tmp_path: Path, peer: Peer) -> None:
    text = f"""
    system: awaiting
    nodes:
      listener: {{class: "{CLASSES}:Listener"}}
      caller: {{class: "{CLASSES}:AsyncCaller"}}
    """
    with running(text, tmp_path):
        response = peer.call(Trigger, "/relay")
    assert (response.success, response.message) == (True, "0")


def test_a_constructor_may_wait_for_a_service_that_is_always_on(tmp_path: Path) -> None:
    text = f"""
    system: waiting
    nodes:
      listener:
        class: {CLASSES}:Listener
        services: {{count: {{type: std_srvs/srv/Trigger, always_on: true}}}}
      waiting:
        class: {CLASSES}:WaitingConstructor
        lifecycle: {{depends_on: [listener]}}
    """
    with running(text, tmp_path) as system:
        assert system.node("waiting").instance.answer.success
        assert "answer 0" in system.log()


def test_callback_groups_exclude_each_other_on_several_threads(tmp_path: Path, peer: Peer) -> None:
    text = f"""
    system: groups
    executors: {{pool: {{kind: multi_threaded, threads: 3}}}}
    nodes:
      groups: {{class: "{CLASSES}:Groups", executor: pool}}
    """
    with running(text, tmp_path) as system:
        peer.publisher(String, "/wait").publish(String())
        peer.publisher(String, "/finish").publish(String())
        wait_until(lambda: system.node("groups").instance.together == 1)


@pytest.mark.parametrize("name", ["Spinner", "Poller"])
def test_a_thread_of_the_class_that_follows_rclpy_ends_with_the_instance(
    tmp_path: Path, name: str
) -> None:
    text = f'system: spins\nnodes: {{spinner: {{class: "{CLASSES}:{name}"}}}}'
    with running(text, tmp_path) as system:
        spinner = system.node("spinner").instance
        wait_until(lambda: system.node("spinner").statistics.sent >= 3)
        assert spinner.thread.is_alive()
        system.change("spinner", "deactivate", "cleanup")
        wait_until(lambda: not spinner.thread.is_alive())
        counted = system.summary("/spinner")
    assert counted.errors == 0


def test_callbacks_of_qos_events_are_called(tmp_path: Path, peer: Peer) -> None:
    text = f"""
    system: matches
    nodes:
      matcher:
        class: {CLASSES}:Matcher
        publishers: {{numbers: {{type: std_msgs/msg/Int64}}}}
      listener:
        class: {CLASSES}:Listener
        subscriptions: {{numbers: {{type: std_msgs/msg/Int64}}}}
    """
    with running(text, tmp_path) as system:
        numbers = peer.listen(Int64, "/numbers")
        matcher = system.node("matcher").instance
        wait_until(lambda: matcher.matches and numbers)
        wait_until(lambda: system.node("listener").instance.numbers)
        assert matcher.matches[-1] == 3  # two of the listener, one of the peer


def test_exceptions_are_errors_of_the_node(tmp_path: Path, peer: Peer) -> None:
    text = f'system: faults\nnodes: {{faulty: {{class: "{CLASSES}:Faulty"}}}}'
    with running(text, tmp_path) as system:
        failed = peer.call(SetBool, "/fail", SetBool.Request(data=True))
        assert (failed.success, failed.message) == (False, "on_fail: ValueError: as requested")
        assert peer.call(SetBool, "/fail", SetBool.Request(data=False)).success
        command = peer.publisher(String, "/command")
        command.publish(String(data="wrong"))
        wait_until(lambda: system.node("faulty").statistics.errors == 2)
        assert "ValueError: wrong" in system.log_text()
        assert system.node("faulty").state == "active"


@pytest.mark.parametrize(
    ("command", "reason"),
    [("exit", "it raised SystemExit"), ("shutdown", "it called rclpy.shutdown()")],
)
def test_a_class_that_ends_its_process_is_deactivated(
    tmp_path: Path, peer: Peer, command: str, reason: str
) -> None:
    text = f"""
    system: ends
    nodes:
      faulty: {{class: "{CLASSES}:Faulty"}}
      listener: {{class: "{CLASSES}:Listener"}}
    """
    with running(text, tmp_path) as system:
        peer.publisher(String, "/command").publish(String(data=command))
        wait_until(lambda: system.node("faulty").state == "inactive")
        assert f"the node is deactivated: {reason}" in system.log()
        assert system.node("listener").state == "active"


def test_a_hanging_callback_of_a_class_is_interrupted_and_its_node_restarted(
    tmp_path: Path, peer: Peer
) -> None:
    text = f"""
    system: hangs
    nodes:
      faulty:
        class: {CLASSES}:Faulty
        lifecycle: {{watch: {{callback_ms: 200}}, on_failure: restart, restart: {{backoff_ms: 1}}}}
    """
    with running(text, tmp_path) as system:
        first = system.node("faulty").instance
        peer.publisher(String, "/command").publish(String(data="hang"))
        wait_until(lambda: system.node("faulty").activations == 2)
        assert system.node("faulty").instance is not first
        assert "on_command took longer than 200 ms" in "\n".join(map(str, system.events))


def test_the_log_of_a_class_goes_to_the_console_and_to_rosout(tmp_path: Path, peer: Peer) -> None:
    lines: list[Any] = peer.listen(Log, "/rosout", LATCHED)
    with running(TALKER_AND_LISTENER, tmp_path) as system:
        system.wait_for_log("got 1")
        wait_until(lambda: any(line.msg == "got 1" for line in lines))
        logger = system.node("listener").instance.get_logger()
        logger.get_child("part").warning("from a part")
        wait_until(lambda: any(line.name == "listener.part" for line in lines))
        assert not logger.debug("not logged")
        assert [line for line in system.log() if line == "got 1"] == ["got 1"]


def test_a_callback_group_of_the_class_is_named_and_log_levels_are_set_per_node(
    tmp_path: Path,
) -> None:
    text = f"""
    system: levels
    nodes:
      loud: {{class: "{CLASSES}:Grouped", log_level: debug}}
      quiet: {{class: "{CLASSES}:Grouped", log_level: error}}
      own:
        log_level: warn
        timers: {{tick: {{period_ms: 10, log: ticking}}}}
    """
    with running(text, tmp_path) as system:
        system.wait_for_log("tick 3")
        wait_until(lambda: system.node("quiet").instance.count >= 3)
        loggers = {event.logger for event in system.reported(Logged)}
        assert loggers == {"loud"}
        warning = "callback group OwnGroup of the class is not asked: its callbacks exclude each"
        assert warning in system.log_text()


def test_isolation_share_assures_that_messages_are_not_used_again(
    tmp_path: Path, peer: Peer
) -> None:
    text = f"""
    system: shared
    nodes:
      reuser:
        class: {CLASSES}:Reuser
        publishers: {{numbers: {{type: std_msgs/msg/Int64, isolation: share}}}}
      listener:
        class: {CLASSES}:Listener
        subscriptions: {{numbers: {{type: std_msgs/msg/Int64, isolation: share}}}}
    """
    with running(text, tmp_path) as system:
        peer.publisher(String, "/go").publish(String())
        listener = system.node("listener").instance
        wait_until(lambda: len(listener.numbers) == 3)
        assert listener.numbers[-1] == 3
        assert listener.numbers != [1, 2, 3]  # one object, which this class does change
