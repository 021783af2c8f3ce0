"""Publishers and subscriptions of a running node: gated, in order, with contained faults."""

from __future__ import annotations

from pathlib import Path

from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String

from composer.runtime.supervision.events import Logged
from tests.ros.support.in_process import Peer, running, wait_until

SYSTEM = """
system: topics
nodes:
  relay:
    subscriptions:
      input:
        type: std_msgs/msg/Int64
        external: true
        log: "got {message.data}, the {count}th"
        publish: {output: {data: "{message.data + 1}"}}
    publishers: {output: {type: std_msgs/msg/Int64, external: true}}
  listener:
    lifecycle: {autostart: inactive}
    subscriptions:
      mode: {type: std_msgs/msg/String, qos: state, external: true, log: "{message.data}"}
      seen:
        {type: std_msgs/msg/String, topic: mode, qos: state, always_on: true, external: true,
         log: "seen {message.data}"}
"""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_reactions_and_messages_latched_while_inactive(tmp_path: Path, peer: Peer) -> None:
    with running(SYSTEM, tmp_path) as system:
        received = peer.listen(Int64, "/output")
        system.wait_for_listener("relay", "output")
        peer.publisher(Int64, "/input").publish(Int64(data=41))
        wait_until(lambda: received)
        assert received[0].data == 42
        assert system.log() == ["got 41, the 0th"]
        source = peer.publisher(String, "/mode", LATCHED)
        source.publish(String(data="old"))
        source.publish(String(data="ready"))
        system.wait_for_log("seen ready")
        assert peer.change("/listener", "activate")
        wait_until(lambda: "ready" in system.log(), "the latched message")
    assert [line for line in system.log()[1:] if "seen" not in line] == ["ready"]


TALKATIVE = """
system: talkative
nodes:
  talkative:
    behavior: talkative:Talkative
    publishers: {output: {type: std_msgs/msg/String, external: true}}
  talker:
    behavior: talkative:Talker
    publishers:
      plain: {type: std_msgs/msg/Int64, topic: /a}
      _hidden: {type: std_msgs/msg/Int64, topic: /b}
      __entries: {type: std_msgs/msg/Int64, topic: /c}
      class: {type: std_msgs/msg/Int64, topic: /d}
      no identifier: {type: std_msgs/msg/Int64, topic: /e}
      "": {type: std_msgs/msg/Int64, topic: /f}
"""
TALKATIVE_MODULE = """
from composer.behavior import Behavior
from std_msgs.msg import String

class Talkative(Behavior):
    def on_configure(self): self.say("configure")
    def on_activate(self): self.say("activate")
    def on_deactivate(self): self.say("deactivate")
    def on_cleanup(self): self.say("cleanup")

    def say(self, text):
        self.publishers.output.publish(String(data=text))
        self.publishers.output.publish(String(data=text))

class Talker(dict):  # any class works
    def on_activate(self):
        for name in dir(self.publishers):
            assert getattr(self.publishers, name) is self.publishers[name]
            self.log.info(name)
        try:
            self.publishers.plan
        except AttributeError as error:
            self.log.info(str(error))
"""


def test_behaviors_have_ports_as_attributes_and_publish_in_transitions_but_not_while_inactive(
    tmp_path: Path, peer: Peer
) -> None:
    with running(TALKATIVE, tmp_path, talkative=TALKATIVE_MODULE) as system:
        names = ["", "__entries", "_hidden", "class", "no identifier", "plain"]
        logged = [event.message for event in system.reported(Logged) if event.logger == "talker"]
        assert logged == [*names, f"no publisher 'plan'; available: {', '.join(names)}"]
        assert peer.change("/talkative", "deactivate")
        received = peer.listen(String, "/output")
        system.wait_for_listener("talkative", "output")
        assert peer.change("/talkative", "activate")
        assert peer.change("/talkative", "deactivate")
        wait_until(lambda: len(received) == 4)  # before the publisher is destroyed
        assert peer.change("/talkative", "cleanup")
        counted = system.summary("/talkative")
    texts = [message.data for message in received]
    assert texts == ["activate", "activate", "deactivate", "deactivate"]
    assert counted.dropped == 4
    warnings = [line for line in system.log() if "drops its messages" in line]
    assert warnings == [
        "publisher 'output' drops its messages: /talkative is configuring, not active",
        "publisher 'output' drops its messages: /talkative is cleaningup, not active",
    ]
