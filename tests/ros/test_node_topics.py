"""Publishers and subscriptions of a running node: gated, in order, and unhurt by user code."""

from __future__ import annotations

from pathlib import Path

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String

from tests.ros.system_bench import Peer, running, wait_until

RELAY = """
system: relay
nodes:
  relay:
    subscriptions:
      input:
        type: std_msgs/msg/Int64
        external: true
        log: "got {message.data}, the {count}th"
        publish: {output: {data: "{message.data + 1}"}}
    publishers:
      output: {type: std_msgs/msg/Int64, external: true}
"""


def test_a_reaction_publishes_and_logs_what_it_works_out(tmp_path: Path, peer: Peer) -> None:
    with running(RELAY, tmp_path) as system:
        heard = peer.listen(Int64, "/output")
        system.wait_for_listener("relay", "output")
        peer.publisher(Int64, "/input").publish(Int64(data=41))
        wait_until(lambda: heard)
    assert heard[0].data == 42
    assert system.log() == ["got 41, the 0th"]


def test_nothing_gets_through_a_node_that_is_not_active(tmp_path: Path, peer: Peer) -> None:
    with running(RELAY, tmp_path) as system:
        heard = peer.listen(Int64, "/output")
        system.wait_for_listener("relay", "output")
        source = peer.publisher(Int64, "/input")
        assert peer.change("/relay", "deactivate")
        for number in range(5):
            source.publish(Int64(data=number))
        wait_until(lambda: system.host._crew.nodes["relay"].statistics.dropped == 5)
        assert peer.change("/relay", "activate")
        source.publish(Int64(data=6))
        wait_until(lambda: heard)
        counted = system.summary("/relay")
    assert [message.data for message in heard] == [7]
    assert (counted.received, counted.sent, counted.dropped) == (1, 1, 5)


def test_what_is_latched_while_inactive_comes_with_the_activation(
    tmp_path: Path, peer: Peer
) -> None:
    text = """
    system: latched
    nodes:
      listener:
        lifecycle: {autostart: inactive}
        subscriptions:
          mode: {type: std_msgs/msg/String, qos: state, external: true, log: "{message.data}"}
    """
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    with running(text, tmp_path) as system:
        source = peer.publisher(String, "/mode", latched)
        source.publish(String(data="old"))
        source.publish(String(data="ready"))
        port = system.host._crew.nodes["listener"]._assembly.subscriptions["mode"]
        wait_until(lambda: [message.data for _, message in tuple(port._latched)] == ["ready"])
        assert system.log() == []
        assert peer.change("/listener", "activate")
        system.wait_for_log("ready")
    assert system.log() == ["ready"]


TALKATIVE = """
system: talkative
nodes:
  talkative:
    behavior: talkative:Talkative
    publishers:
      output: {type: std_msgs/msg/String, external: true}
"""


def test_a_node_has_a_first_and_a_last_word_but_none_when_it_is_not_active(
    tmp_path: Path, peer: Peer
) -> None:
    module = """
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
    """
    with running(TALKATIVE, tmp_path, talkative=module) as system:
        assert peer.change("/talkative", "deactivate")
        heard = peer.listen(String, "/output")
        system.wait_for_listener("talkative", "output")
        assert peer.change("/talkative", "activate")
        assert peer.change("/talkative", "deactivate")
        assert peer.change("/talkative", "cleanup")
        wait_until(lambda: len(heard) == 4)
        counted = system.summary("/talkative")
    texts = [message.data for message in heard]
    assert texts == ["activate", "activate", "deactivate", "deactivate"]
    assert counted.dropped == 4
    warnings = [line for line in system.log() if "drops its messages" in line]
    assert warnings == [
        "publisher 'output' drops its messages: /talkative is configuring, not active",
        "publisher 'output' drops its messages: /talkative is cleaningup, not active",
    ]


PORTS = """
system: ports
nodes:
  talker:
    behavior: talker:Talker
    publishers:
      plain: {type: std_msgs/msg/Int64, topic: /a}
      _hidden: {type: std_msgs/msg/Int64, topic: /b}
      __entries: {type: std_msgs/msg/Int64, topic: /c}
      class: {type: std_msgs/msg/Int64, topic: /d}
      no identifier: {type: std_msgs/msg/Int64, topic: /e}
      "": {type: std_msgs/msg/Int64, topic: /f}
"""
PORTS_MODULE = """
class Talker(dict):  # any class will do
    def on_activate(self):
        for name in dir(self.publishers):
            assert getattr(self.publishers, name) is self.publishers[name]
            self.log.info(name)
        try:
            self.publishers.plan
        except AttributeError as error:
            self.log.info(str(error))
"""


def test_ports_are_attributes_of_what_a_behavior_has(tmp_path: Path) -> None:
    with running(PORTS, tmp_path, talker=PORTS_MODULE) as system:
        names = ["", "__entries", "_hidden", "class", "no identifier", "plain"]
        assert system.log() == [*names, f"no publisher 'plan'; there is: {', '.join(names)}"]


FAULTY = """
system: faulty
executors: {shared: {kind: KIND}}
nodes:
  faulty:
    executor: shared
    behavior: faulty:Faulty
    subscriptions:
      input: {type: std_msgs/msg/Int64, external: true, set: {last: "{message.data}"}}
    state: {last: 0}
  healthy:
    executor: shared
    subscriptions:
      input: {type: std_msgs/msg/Int64, external: true, log: "healthy {message.data}"}
"""
FAULTY_MODULE = """
from composer.behavior import Behavior

class Faulty(Behavior):
    def on_input(self, message):
        if message.data == 1:
            raise ValueError("one is too much")
        if message.data == 2:
            raise SystemExit(3)
        self.log.info(f"faulty {message.data}")
"""


@pytest.mark.parametrize("kind", ["events", "single_threaded", "multi_threaded"])
def test_what_a_handler_raises_is_told_and_hurts_nobody(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    text = FAULTY.replace("KIND", kind)
    with running(text, tmp_path, faulty=FAULTY_MODULE) as system:
        source = peer.publisher(Int64, "/input")
        wait_until(lambda: source.get_subscription_count() == 2)
        for number in (1, 2, 3):
            source.publish(Int64(data=number))
        system.wait_for_log("faulty 3")
        system.wait_for_log("healthy 3")
        fault = system.wait_for_log("one is too much")
        counted = system.summary("/faulty")
    assert fault.startswith("on_input: ValueError: one is too much\nTraceback")
    assert 'raise ValueError("one is too much")' in fault
    assert counted.errors == 2
    assert system.end().exit_code == 0


SLOW = """
system: slow
nodes:
  slow:
    behavior: slow:Slow
    subscriptions:
      input: {type: std_msgs/msg/Int64, external: true, qos: {depth: 2}, reentrant: REENTRANT}
      release: {type: std_msgs/msg/Int64, external: true}
"""
SLOW_MODULE = """
from composer.behavior import Behavior

class Slow(Behavior):
    def on_configure(self):
        self.free = False

    async def on_input(self, message):
        self.log.info(f"begin {message.data}")
        while not self.free:
            await self.clock.sleep(0.001)
        self.log.info(f"end {message.data}")

    def on_release(self, message):
        self.free = True
"""


def test_messages_wait_for_a_handler_that_awaits_and_the_oldest_makes_room(
    tmp_path: Path, peer: Peer
) -> None:
    with running(SLOW.replace("REENTRANT", "false"), tmp_path, slow=SLOW_MODULE) as system:
        source, release = peer.publisher(Int64, "/input"), peer.publisher(Int64, "/release")
        source.publish(Int64(data=0))
        system.wait_for_log("begin 0")
        node = system.host._crew.nodes["slow"]
        waiting = node._assembly.subscriptions["input"]._mailbox._messages
        for number in range(1, 5):
            source.publish(Int64(data=number))
            wait_until(lambda n=number: len(waiting) + node.statistics.dropped == n)
        release.publish(Int64())
        system.wait_for_log("end 4")
        counted = system.summary("/slow")
    assert system.log() == [f"{word} {number}" for number in (0, 3, 4) for word in ("begin", "end")]
    assert counted.dropped == 2


def test_runs_of_a_reentrant_port_overlap(tmp_path: Path, peer: Peer) -> None:
    with running(SLOW.replace("REENTRANT", "true"), tmp_path, slow=SLOW_MODULE) as system:
        source, release = peer.publisher(Int64, "/input"), peer.publisher(Int64, "/release")
        for number in range(4):
            source.publish(Int64(data=number))
            system.wait_for_log(f"begin {number}")
        assert "end" not in system.log_text()
        release.publish(Int64())
        for number in range(4):
            system.wait_for_log(f"end {number}")


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_what_comes_while_a_node_rests_does_not_wait_for_it(tmp_path: Path, kind: str) -> None:
    """A handler of before still awaits something, so that nobody takes what comes out of the queue.

    Nothing of it may be left for when the node is active again.
    """
    text = f"""
    system: resting
    executors: {{chosen: {{kind: {kind}}}}}
    nodes:
      source:
        executor: chosen
        behavior: resting:Source
        publishers:
          output: {{type: std_msgs/msg/Int64, topic: /numbers}}
      sink:
        executor: chosen
        behavior: resting:Sink
        subscriptions:
          input: {{type: std_msgs/msg/Int64, topic: /numbers}}
    """
    module = """
    from composer.behavior import Behavior
    from rclpy.task import Future

    class Source(Behavior):
        pass

    class Sink(Behavior):
        def on_configure(self):
            self.release = Future()

        async def on_input(self, message):
            self.log.info(f"begin {message.data}")
            await self.release
            self.log.info(f"end {message.data}")
    """
    with running(text, tmp_path, resting=module) as system:
        source, sink = (system.host._crew.nodes[name] for name in ("source", "sink"))
        output = source._assembly.senders["output"]
        output.publish(Int64(data=0))
        system.wait_for_log("begin 0")
        system.change("sink", "deactivate")
        output.publish(Int64(data=1))
        output.publish(Int64(data=2))
        system.change("sink", "activate")
        output.publish(Int64(data=3))
        assert "begin 3" not in system.log_text()  # one at a time, also from before
        sink._behavior.release.set_result(None)
        system.wait_for_log("end 3")
        counted = system.summary("/sink")
    words = [f"{word} {number}" for number in (0, 3) for word in ("begin", "end")]
    assert [line for line in system.log() if line in words or line.startswith("begin")] == words
    assert (counted.received, counted.dropped) == (2, 2)


def test_reentrant_callbacks_run_at_once_on_several_threads(tmp_path: Path) -> None:
    text = """
    system: overlapping
    executors: {several: {kind: multi_threaded, threads: 3}}
    nodes:
      source:
        behavior: overlapping:Source
        publishers:
          output: {type: std_msgs/msg/Int64, topic: /numbers}
      sink:
        executor: several
        behavior: overlapping:Sink
        subscriptions:
          input: {type: std_msgs/msg/Int64, topic: /numbers, reentrant: true}
    """
    module = """
    import threading
    from composer.behavior import Behavior

    class Source(Behavior):
        pass

    class Sink(Behavior):
        def on_configure(self):
            self.both = threading.Barrier(2, timeout=20.0)

        def on_input(self, message):
            self.both.wait()
            self.log.info(f"met {message.data}")
    """
    with running(text, tmp_path, overlapping=module) as system:
        output = system.host._crew.nodes["source"]._assembly.senders["output"]
        output.publish(Int64(data=0))
        output.publish(Int64(data=1))
        for number in range(2):
            system.wait_for_log(f"met {number}")


def test_the_callbacks_of_a_node_take_turns_on_several_threads(tmp_path: Path, peer: Peer) -> None:
    text = """
    system: turns
    executors: {several: {kind: multi_threaded, threads: 4}}
    nodes:
      turns:
        executor: several
        behavior: turns:Turns
        subscriptions:
          input: {type: std_msgs/msg/Int64, external: true}
        timers:
          tick: {period_ms: 2}
          async_tick: {period_ms: 2}
    """
    module = """
    import threading
    from time import sleep
    from composer.behavior import Behavior

    class Turns(Behavior):
        def on_configure(self):
            self.inside = 0
            self.most = 0
            self.calls = 0
            self.threads = set()

        def work(self):
            self.inside += 1
            self.most = max(self.most, self.inside)
            self.threads.add(threading.current_thread().name)
            sleep(0.001)
            self.inside -= 1
            self.calls += 1
            if self.calls == 300:
                self.log.info(f"at most {self.most} at once")

        def on_input(self, message): self.work()
        def on_tick(self): self.work()
        async def on_async_tick(self):
            self.work()
            await self.clock.sleep(0.001)
            self.work()
    """
    with running(text, tmp_path, turns=module) as system:
        source = peer.publisher(Int64, "/input")
        for number in range(50):
            source.publish(Int64(data=number))
        line = system.wait_for_log("at once")
    assert line == "at most 1 at once"
