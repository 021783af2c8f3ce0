"""The lives of hosted classes, and of what libraries create with a behavior's ``self.node``."""

from __future__ import annotations

import gc
from pathlib import Path

from std_msgs.msg import Int64, String

from composer.model import PrimaryState
from composer.runtime.supervision.events import NodeFailed
from tests.ros.support import node_classes
from tests.ros.support.in_process import Peer, running, wait_until
from tests.ros.support.node_classes import LATCHED, history

CLASSES = "tests.ros.support.node_classes"


def test_an_instance_lives_from_configure_to_cleanup(tmp_path: Path, peer: Peer) -> None:
    history.clear()
    text = f'system: lives\nnodes: {{talker: {{class: "{CLASSES}:Talker"}}}}'
    with running(text, tmp_path, autostart=PrimaryState.UNCONFIGURED) as system:
        assert history == []
        wait_until(lambda: peer.node.count_services("/talker/change_state") == 1)
        assert peer.change("/talker", "configure")
        assert history == ["constructed"]
        first = system.node("talker").instance
        assert peer.change("/talker", "activate")
        numbers = peer.listen(Int64, "/numbers")
        wait_until(lambda: numbers)
        assert peer.set_parameter("/talker", "word", "kept") == ""
        assert peer.change("/talker", "deactivate")
        assert peer.change("/talker", "cleanup")
        assert history == ["constructed", "destroyed"]
        wait_until(lambda: peer.node.count_publishers("/numbers") == 0)
        assert peer.set_parameter("/talker", "period", "x")  # of another type
        assert peer.set_parameter("/talker", "word", "kept while unconfigured") == ""
        system.change("talker", "configure", "activate")
        again = system.node("talker").instance
        assert again is not first
        assert again.get_parameter("word").value == "kept while unconfigured"
        assert again.get_parameter("period").value == 0.01
    assert history == ["constructed", "destroyed"] * 2


def test_parameters_that_are_set_before_the_first_configuration_are_kept(
    tmp_path: Path, peer: Peer
) -> None:
    text = f"""
    system: early
    lifecycle: {{autostart: unconfigured}}
    nodes:
      talker:
        class: "{CLASSES}:Talker"
        parameters: {{word: {{type: string, default: declared}}, period: 0.5}}
      behavior:
        behavior: early:Early
        parameters: {{word: {{type: string, default: declared}}}}
      declarative:
        parameters: {{word: {{type: string, default: declared}}}}
        on_configure: {{log: "the word is {{parameters.word}}"}}
    """
    early = """
    from composer.behavior import Behavior

    class Early(Behavior):
        def on_configure(self):
            self.log.info(f"its word is {self.parameters.word}")
    """
    with running(text, tmp_path, early=early) as system:
        for name in ("talker", "behavior", "declarative"):
            assert peer.set_parameter(f"/{name}", "word", "early") == ""
        assert peer.set_parameter("/talker", "period", "x")  # of another type
        assert peer.set_parameter("/talker", "period", -1.0) == ""  # no class has such a timer
        failed = system.node("talker").loop.run_task(
            system.node("talker").lifecycle.change("configure")
        )
        wait_until(failed.done)
        assert not failed.result().success
        assert peer.set_parameter("/talker", "word", "early") == ""
        for name in ("talker", "behavior", "declarative"):
            system.change(name, "configure")
        talker = system.node("talker").instance
        assert talker.get_parameter("word").value == "early"
        assert talker.get_parameter("period").value == 0.5
        system.wait_for_log("its word is early")
        system.wait_for_log("the word is early")


def test_the_handlers_of_a_lifecycle_node_class_are_called_and_may_refuse(
    tmp_path: Path, peer: Peer
) -> None:
    history.clear()
    text = f"""
    system: counting
    nodes:
      counter:
        class: {CLASSES}:Counter
        publishers: {{numbers: {{type: std_msgs/msg/Int64, external: true}}}}
      refusing:
        class: {CLASSES}:Counter
        lifecycle: {{autostart: unconfigured}}
        parameters: {{refuse: {{type: string, default: configure}}}}
        remappings: {{numbers: others}}
    """
    with running(text, tmp_path) as system:
        assert "has not created" not in system.log_text()  # on_configure does
        numbers = peer.listen(Int64, "/numbers")
        wait_until(lambda: len(numbers) >= 3)
        counter = system.node("counter").instance
        counter.trigger_deactivate()
        wait_until(lambda: system.node("counter").state == "inactive")
        assert counter.calls == ["configure from unconfigured", "activate", "deactivate"]
        count = counter.count
        assert peer.state("/counter") == "inactive"
        assert counter.count == count
        system.change("counter", "cleanup")
        assert history == ["cleaned up"]
        wait_until(lambda: peer.node.count_services("/refusing/change_state") == 1)
        assert not peer.change("/refusing", "configure")
        assert system.node("refusing").state == "unconfigured"
        system.wait_for_log("on_configure refused the transition: on_configure returned FAILURE")


REFUSED = [
    ("SpinsInConstructor", "spins its node in its constructor or a transition"),
    ("MakesSecondNode", "creates a second node, 'helper'"),
    ("HasOwnArguments", "command-line arguments of its own; use 'remappings'"),
    ("HasOwnContext", "a context of its own; a hosted node joins the context of the system"),
    ("CallsInitTwice", "the class calls Node.__init__ twice"),
    ("HasWaitable", "has a waitable of its own, Waitable; run it as an 'executable'"),
    ("Exits", "the constructor ends the process: SystemExit(3)"),
    ("NotANode", "is not derived from rclpy's Node"),
    ("Missing", "has no class 'Missing'"),
    ("WantsArguments", "missing 1 required positional argument: 'port'"),
    ("NeverReturns", "timed out after 0.3 s"),
]


def test_what_cannot_be_hosted_is_refused_with_the_reason(tmp_path: Path) -> None:
    text = "system: refused\nexecutors: {own: {}}\nnodes:\n"
    for name, _ in REFUSED:
        slow = name == "NeverReturns"
        keys = f"lifecycle: {{timeout_ms: {300 if slow else 20_000}}}{', executor: own' * slow}"
        text += f"  {name}: {{class: tests.ros.support.refused_classes:{name}, {keys}}}\n"
    with running(text, tmp_path) as system:
        outcome = system.end()
    assert outcome.exit_code == 1
    reasons = {node: event.reason for event in system.reported(NodeFailed) for node in event.nodes}
    log = system.log_text()
    for name, reason in REFUSED:
        assert reason in reasons[f"/{name}"] or (name == "NeverReturns" and reason in log)
    assert "constructor has not returned; it is at" in log
    assert "Traceback" not in log


def test_what_is_declared_otherwise_than_in_the_class_is_refused_or_reported(
    tmp_path: Path,
) -> None:
    text = f"""
    system: wrong
    nodes:
      wrong:
        class: {CLASSES}:Talker
        publishers: {{numbers: {{type: std_msgs/msg/String}}}}
      talker:
        class: {CLASSES}:Talker
        publishers:
          other: {{type: std_msgs/msg/Int64, external: true}}
          numbers: {{type: std_msgs/msg/Int64, external: true, qos: sensor_data}}
        parameters: {{speed: {{type: double, default: 1}}}}
    """
    with running(text, tmp_path) as system:
        system.wait_for_failure("/wrong")
        assert system.node("talker").state == "active"
        log = system.log()
    assert (
        "publisher 'numbers' on /numbers is declared as std_msgs/msg/String, but the class creates"
        " std_msgs/msg/Int64; declare 'type: std_msgs/msg/Int64'"
    ) in "\n".join(log)
    assert "the class has not created publisher 'other' on /other" in log
    assert "the class has not declared parameter 'speed'" in log
    qos = "publisher 'numbers': reliability is reliable, declared as best_effort"
    assert f"QoS of the class counts: {qos}" in log


def test_a_thread_that_outlives_its_instance_is_an_error(tmp_path: Path) -> None:
    text = f'system: stubborn\nnodes: {{stubborn: {{class: "{CLASSES}:Stubborn"}}}}'
    try:
        with running(text, tmp_path) as system:
            system.change("stubborn", "deactivate", "cleanup")
            system.wait_for_log("cleanup: thread 'stubborn' of the class still runs")
            assert system.node("stubborn").statistics.errors == 1
    finally:
        node_classes.Stubborn.release.set()


def test_nodes_change_their_states_at_the_same_time_and_leave_nothing_behind(
    tmp_path: Path,
) -> None:
    kinds = ("Talker", "Listener", "Counter", "Navigator", "Sender", "Spinner", "Matcher", "Poller")
    counted = (node_classes.Talker, node_classes.Listener, node_classes.Counter)
    entries = "".join(
        f"  n{index}: {{class: '{CLASSES}:{kind}', namespace: g{index}}}\n"
        for index, kind in enumerate(kinds)
    )

    def counts() -> tuple[int, int]:
        gc.collect()
        instances = sum(isinstance(item, counted) for item in gc.get_objects())
        return instances, len(list(Path("/proc/self/fd").iterdir()))

    with running(f"system: crowd\nnodes:\n{entries}", tmp_path) as system:
        nodes = [system.node(f"n{index}") for index in range(len(kinds))]

        def live() -> None:
            for transition in ("deactivate", "cleanup", "configure", "activate"):
                done = [node.loop.run_task(node.lifecycle.change(transition)) for node in nodes]
                wait_until(lambda done=done: all(future.done() for future in done), transition)
                assert all(future.result().success for future in done)

        live()
        wait_until(lambda: counts()[0] == len(counted), "the end of the first instances")
        before = counts()
        for _ in range(6):
            live()
        wait_until(lambda: counts() == before, f"{counts()} instead of {before}")
        assert not any(node.statistics.errors for node in nodes)
        assert "Error" not in system.log_text()


LIBRARY = """
system: library
nodes:
  user:
    behavior: user:User
    lifecycle: {autostart: inactive}
    parameters: {gain: {type: double, default: 1.0}}
    publishers: {numbers: {type: std_msgs/msg/Int64, qos: command, external: true}}
  own: {behavior: "user:Own"}
"""
#: Like the listeners and broadcasters of tf2_ros, and the subscribers of message_filters.
USER = """
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String

class Library:
    def __init__(self, node):
        assert isinstance(node, Node)
        self.node = node
        self.received = []
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.declare_parameter("library.rate", 100.0)
        self.frames = node.create_publisher(String, "frames", latched)
        self.frames.publish(String(data="base"))
        self.numbers = node.create_publisher(Int64, "numbers", 10)
        node.create_subscription(Int64, "commands", self.on_command, 10)
        self.count = 0
        node.create_timer(1.0 / node.get_parameter("library.rate").value, self.on_tick)

    def on_command(self, message):
        self.received.append(message.data)

    def on_tick(self):
        self.count += 1
        self.numbers.publish(Int64(data=self.count))

class User:
    def on_configure(self):
        self.helper = Library(self.node)

class Own:
    def __init__(self):
        self.node = "mine"  # an attribute of that name is kept

    def on_activate(self):
        self.log.info(self.node)
"""


def test_what_a_library_creates_follows_the_lifecycle(tmp_path: Path, peer: Peer) -> None:
    with running(LIBRARY, tmp_path, user=USER) as system:
        system.wait_for_log("mine")
        undeclared = [line for line in system.log() if "is not declared" in line]
        assert undeclared == [
            "publisher on /frames is not declared: it uses DDS (std_msgs/msg/String)",
            "subscription on /commands is not declared: it uses DDS (std_msgs/msg/Int64)",
        ]
        numbers, frames = peer.listen(Int64, "/numbers"), peer.listen(String, "/frames", LATCHED)
        commands = peer.publisher(Int64, "/commands")
        library = system.behavior("user").helper
        commands.publish(Int64(data=1))
        wait_until(lambda: system.node("user").statistics.dropped == 1)
        assert (numbers, frames, library.count, library.received) == ([], [], 0, [])
        system.change("user", "activate")
        wait_until(lambda: numbers and frames)
        commands.publish(Int64(data=2))
        wait_until(lambda: library.received == [2])
        assert peer.set_parameter("/user", "library.rate", 50.0) == ""
        assert peer.set_parameter("/user", "gain", 2.0) == ""
        system.change("user", "deactivate")
        count = library.count
        system.change("user", "cleanup")
        assert library.count == count
        wait_until(lambda: peer.node.count_publishers("/frames") == 0)
        system.change("user", "configure", "activate")
        again = system.behavior("user").helper
        wait_until(lambda: again.count >= 1)
        assert again.node.get_parameter("library.rate").value == 50.0
        assert again.node.get_parameter("gain").value == 2.0
        counted = system.summary("/user")
    assert counted.errors == 0
