"""Unmodified rclpy node classes as nodes of a system: what they send, receive and call."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String
from std_srvs.srv import SetBool, Trigger

from composer.runtime.supervision.events import Logged
from tests.ros.support.in_process import Peer, running, wait_until
from tests.ros.support.node_classes import LATCHED

CLASSES = "tests.ros.support.node_classes"
CALLBACK_CLASSES = "tests.ros.support.callback_classes"
TALKER_AND_LISTENER = f"""
system: pair
nodes:
  talker:
    class: {CLASSES}:Talker
    publishers: {{numbers: {{type: std_msgs/msg/Int64}}}}
    parameters: {{period: {{type: double, default: 0.2}}}}  # a queue holds ten messages
    lifecycle: {{depends_on: [listener]}}
  listener:
    class: {CLASSES}:Listener
    subscriptions: {{numbers: {{type: std_msgs/msg/Int64}}}}
"""


def test_messages_stay_in_the_process_and_external_nodes_see_an_ordinary_node(
    tmp_path: Path, peer: Peer
) -> None:
    lines: list[Any] = peer.listen(Log, "/rosout", LATCHED)
    with running(TALKER_AND_LISTENER, tmp_path) as system:
        listener = system.node("listener").instance
        wait_until(lambda: len(listener.numbers) >= 5 and len(listener.infos) >= 5)
        assert listener.numbers[:5] == [1, 2, 3, 4, 5]
        # The middleware numbers its messages: in-process messages have no number.
        assert listener.infos[:5] == [(number, None) for number in range(1, 6)]
        line = "publisher on /talker/words is not declared: it uses DDS (std_msgs/msg/String)"
        assert line in system.log()

        numbers = peer.listen(Int64, "/numbers")
        wait_until(lambda: len(numbers) >= 3)
        assert peer.call(Trigger, "/count").success
        names = peer.node.get_node_names_and_namespaces
        wait_until(lambda: names().count(("talker", "/")) == 1)
        for service in ("get_parameters", "change_state"):
            wait_until(lambda name=f"/talker/{service}": peer.node.count_services(name) == 1)
        assert peer.set_parameter("/talker", "word", "changed") == ""
        words = peer.listen(String, "/talker/words")
        wait_until(lambda: words and words[-1].data == "message changed")
        assert system.node("talker").state == "active"

        # The log of a class goes to the console and to /rosout.
        assert [line for line in system.log() if line == "got 1"] == ["got 1"]
        got = wait_until(lambda: next((line for line in lines if line.msg == "got 1"), None))
        assert got.file.endswith("/node_classes.py")
        assert (got.function, got.line > 0) == ("on_number", True)
        logger = listener.get_logger()
        logger.get_child("part").warning("from a part")
        wait_until(lambda: any(line.name == "listener.part" for line in lines))
        assert not logger.debug("not logged")
        counted = system.summary("/listener")
    assert counted.errors == 0
    assert counted.received >= 10


@pytest.mark.parametrize("isolation", ["", ", isolation: share"])
def test_a_message_object_that_is_published_again_arrives_as_it_was_unless_it_is_shared(
    tmp_path: Path, peer: Peer, isolation: str
) -> None:
    text = f"""
    system: reuse
    executors: {{one: {{kind: single_threaded}}}}
    nodes:
      reuser:
        executor: one
        class: {CLASSES}:Reuser
        publishers: {{numbers: {{type: std_msgs/msg/Int64{isolation}}}}}
      listener:
        executor: one
        class: {CLASSES}:Listener
        subscriptions: {{numbers: {{type: std_msgs/msg/Int64{isolation}}}}}
    """
    with running(text, tmp_path) as system:
        peer.publisher(String, "/go").publish(String())
        listener = system.node("listener").instance
        wait_until(lambda: len(listener.numbers) == 3)
        # With 'share', it is one object, which this class changes before the listener is called.
        assert listener.numbers == ([3, 3, 3] if isolation else [1, 2, 3])


def test_instances_have_their_own_names_parameters_and_connections(
    tmp_path: Path, peer: Peer
) -> None:
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
        publishers: {{numbers: {{type: std_msgs/msg/Int64}}}}
      listener:
        class: {CLASSES}:Listener
        subscriptions: {{numbers: {{type: std_msgs/msg/Int64}}}}
    connections: [{{topic: /renamed, from: rear.numbers, to: [listener.numbers]}}]
    """
    with running(text, tmp_path) as system:
        spoken = peer.listen(String, "/robot/spoken")
        rear = peer.listen(String, "/rear/words")
        wait_until(lambda: spoken and rear)
        assert spoken[0].data == "front left"
        assert rear[0].data == "rear hello"
        wait_until(lambda: peer.node.count_publishers("/all/numbers") == 1)
        front = system.node("front").instance
        assert front.get_fully_qualified_name() == "/robot/front"
        assert front.resolve_topic_name("numbers") == "/all/numbers"
        assert system.node("rear").instance.publisher.topic_name == "/renamed"
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


def test_exceptions_are_errors_and_a_class_that_ends_its_process_is_deactivated(
    tmp_path: Path, peer: Peer
) -> None:
    text = f"""
    system: faults
    nodes:
      faulty: {{class: "{CLASSES}:Faulty"}}
      listener: {{class: "{CLASSES}:Listener"}}
    """
    with running(text, tmp_path) as system:
        faulty = system.node("faulty")
        failed = peer.call(SetBool, "/fail", SetBool.Request(data=True))
        assert (failed.success, failed.message) == (False, "on_fail: ValueError: as requested")
        assert peer.call(SetBool, "/fail", SetBool.Request(data=False)).success
        command = peer.publisher(String, "/command")
        command.publish(String(data="wrong"))
        wait_until(lambda: faulty.statistics.errors == 2)
        system.wait_for_log("ValueError: wrong")
        assert faulty.state == "active"
        for word, reason in (
            ("exit", "it raised SystemExit"),
            ("shutdown", "it called rclpy.shutdown()"),
        ):
            command.publish(String(data=word))
            wait_until(lambda: faulty.state == "inactive")
            assert system.wait_for_log(f"the node is deactivated: {reason}")
            assert system.node("listener").state == "active"
            system.change("faulty", "activate")


@pytest.mark.parametrize(
    ("name", "callback"),
    [
        (f"{CLASSES}:Faulty", "on_command"),
        (f"{CALLBACK_CLASSES}:HangingTimer", "tick"),
        (f"{CALLBACK_CLASSES}:CallerWithoutServer", "on_timer"),  # waits, without a command
    ],
)
def test_a_hanging_callback_of_a_class_is_interrupted_and_its_node_restarted(
    tmp_path: Path, peer: Peer, name: str, callback: str
) -> None:
    text = f"""
    system: hangs
    nodes:
      faulty:
        class: {name}
        lifecycle: {{watch: {{callback_ms: 200}}, on_failure: restart, restart: {{backoff_ms: 1}}}}
    """
    with running(text, tmp_path) as system:
        first = system.node("faulty").instance
        if callback != "on_timer":
            peer.publisher(String, "/command").publish(String(data="hang"))
        wait_until(lambda: system.node("faulty").activations >= 2)
        assert system.node("faulty").instance is not first
        assert f"{callback} took longer than 200 ms" in "\n".join(map(str, system.events))


def test_log_levels_are_set_per_node(tmp_path: Path) -> None:
    text = f"""
    system: levels
    nodes:
      loud: {{class: "{CALLBACK_CLASSES}:Throttled", log_level: debug}}
      quiet: {{class: "{CALLBACK_CLASSES}:Throttled", log_level: error}}
      own: {{log_level: warn, timers: {{tick: {{period_ms: 10, log: ticking}}}}}}
    """
    with running(text, tmp_path) as system:
        system.wait_for_log("tick 3")
        wait_until(lambda: system.node("quiet").instance.ticks >= 3)
        loggers = {event.logger for event in system.reported(Logged)}
        assert loggers == {"loud"}
