"""In-process delivery has the same semantics as DDS: one table for both."""

from __future__ import annotations

from pathlib import Path

import pytest
from std_msgs.msg import Int64

from composer.model import LogLevel
from composer.runtime.host_options import HostOptions
from tests.ros.support.in_process import running, wait_until

SENT = 30
#: Offered, requested, and which of the 30 messages sent in one callback are received.
TABLE = {
    "deep": ("{depth: 50}", "{depth: 50}", range(SENT)),
    "drops_oldest": ("{depth: 50}", "{depth: 5}", range(SENT - 5, SENT)),
    "best_effort": (
        "{depth: 50, reliability: best_effort}",
        "{depth: 7, reliability: best_effort}",
        range(SENT - 7, SENT),
    ),
    "weaker_request": ("{depth: 50}", "{depth: 50, reliability: best_effort}", range(SENT)),
    "stronger_request": ("{depth: 50, reliability: best_effort}", "{depth: 50}", range(0)),
    "keeps_all": ("{history: keep_all}", "{history: keep_all}", range(SENT)),
    "no_latch": ("{depth: 50}", "{depth: 50, durability: transient_local}", range(0)),
    "latch": (
        "{depth: 50, durability: transient_local}",
        "{depth: 9, durability: transient_local}",
        range(SENT - 9, SENT),
    ),
    "latch_unused": ("{depth: 50, durability: transient_local}", "{depth: 50}", range(SENT)),
}
MODULE = """
from composer.behavior import Behavior
from std_msgs.msg import Int64

class Source(Behavior):
    def on_configure(self):
        self.sent = []

    def send(self, topics, count):
        for name in topics:
            for number in range(count):
                self.sent.append(Int64(data=number))
                self.publishers[name].publish(self.sent[-1])

class Sink(Behavior):
    def on_configure(self):
        self.received = []

    def on_input(self, message):
        self.received.append(message)
"""


def text_of(delivery: str, executor: str) -> str:
    """Return a system with a topic and a sink for each row."""
    publishers = "".join(
        f"      {name}: {{type: std_msgs/msg/Int64, topic: /{name}, qos: {offered}}}\n"
        for name, (offered, _, _) in TABLE.items()
    )
    sinks = "".join(
        f"  {name}:\n    behavior: table:Sink\n    executor: own\n    subscriptions:\n"
        f"      input: {{type: std_msgs/msg/Int64, topic: /{name}, qos: {requested}}}\n"
        for name, (_, requested, _) in TABLE.items()
    )
    return (
        f"system: table\ndelivery: {delivery}\nexecutors: {{own: {{kind: {executor}}}}}\nnodes:\n"
        f"  source:\n    behavior: table:Source\n    executor: own\n    publishers:\n"
        f"{publishers}{sinks}"
    )


@pytest.mark.parametrize("delivery", ["auto", "dds"])
@pytest.mark.parametrize("executor", ["events", "multi_threaded"])
def test_every_combination_of_qos_delivers_the_same_in_process_and_by_dds(
    tmp_path: Path, executor: str, delivery: str
) -> None:
    with running(text_of(delivery, executor), tmp_path, table=MODULE) as system:
        source = system.node("source")
        source.loop.run(lambda: system.behavior("source").send(TABLE, SENT))
        for name, (_, _, wanted) in TABLE.items():
            sink = system.behavior(name)
            wait_until(lambda sink=sink, wanted=wanted: len(sink.received) >= len(wanted), name)
        # Sent last, by the same path: late or duplicate messages would have arrived before.
        source.loop.run(lambda: system.behavior("source").send(["deep"], 1))
        deep = system.behavior("deep")
        wait_until(lambda: len(deep.received) == SENT + 1)
        received = {name: [item.data for item in system.behavior(name).received] for name in TABLE}
        assert received == {
            name: [*wanted, 0] if name == "deep" else list(wanted)
            for name, (_, _, wanted) in TABLE.items()
        }
        same = any(message is system.behavior("source").sent[0] for message in deep.received)
        assert same is (delivery == "auto")


COPIED = """
system: copied
nodes:
  source:
    behavior: table:Source
    publishers:
      shared: {type: std_msgs/msg/Int64}
      copied: {type: std_msgs/msg/Int64}
      by_dds: {type: std_msgs/msg/Int64}
  shared: {behavior: table:Sink, subscriptions: {input: {type: std_msgs/msg/Int64}}}
  copied: {behavior: table:Sink, subscriptions: {input: {type: std_msgs/msg/Int64}}}
  by_dds: {behavior: table:Sink, subscriptions: {input: {type: std_msgs/msg/Int64}}}
connections:
  - {topic: /shared, from: source.shared, to: shared.input}
  - {topic: /copied, from: source.copied, to: copied.input, isolation: copy}
  - {topic: /by_dds, from: source.by_dds, to: by_dds.input, delivery: dds}
"""


def test_a_connection_may_require_copies_or_dds(tmp_path: Path) -> None:
    options = HostOptions(log_level=LogLevel.DEBUG)
    with running(COPIED, tmp_path, options=options, table=MODULE) as system:
        source = system.node("source")
        sinks = {name: system.behavior(name) for name in ("shared", "copied", "by_dds")}

        def publish_and_change() -> None:
            for name in sinks:
                message = Int64(data=1)
                system.sender("source", name).publish(message)
                message.data = 2

        source.loop.run(publish_and_change)
        wait_until(lambda: all(sink.received for sink in sinks.values()))
        received = {name: [item.data for item in sink.received] for name, sink in sinks.items()}
    said = [line for line in system.log() if "uses DDS only" in line]
    assert said == [
        f"{end} uses DDS only: 'delivery: dds' is set"
        for end in ("publisher 'by_dds'", "subscription 'input'")
    ]
    assert received == {"shared": [2], "copied": [1], "by_dds": [1]}


OF_THEIR_OWN = """
system: own
nodes:
  source:
    behavior: own:Source
    publishers:
      copied: {type: std_msgs/msg/Int64}
      latched: {type: std_msgs/msg/Int64, qos: state}
  first: {behavior: own:Changer, subscriptions: {input: {type: std_msgs/msg/Int64}}}
  second: {behavior: own:Changer, subscriptions: {input: {type: std_msgs/msg/Int64}}}
  late:
    behavior: own:Changer
    lifecycle: {autostart: unconfigured}
    subscriptions: {input: {type: std_msgs/msg/Int64, qos: state}}
connections:
  - {topic: /copied, from: source.copied, to: [first.input, second.input], isolation: copy}
  - {topic: /latched, from: source.latched, to: late.input, isolation: copy}
"""
CHANGERS = """
from composer.behavior import Behavior
from std_msgs.msg import Int64

class Source(Behavior):
    def send(self):
        for publisher in (self.publishers.copied, self.publishers.latched):
            message = Int64(data=1)
            publisher.publish(message)
            message.data = 7

class Changer(Behavior):
    def on_configure(self):
        self.received = []

    def on_input(self, message):
        self.received.append(message.data)
        message.data = 9
"""


def test_each_receiver_has_its_own_copy_even_of_latched_messages(tmp_path: Path) -> None:
    with running(OF_THEIR_OWN, tmp_path, own=CHANGERS) as system:
        source = system.node("source")
        source.loop.run(system.behavior("source").send)
        system.change("late", "configure", "activate")
        names = ("first", "second", "late")
        wait_until(lambda: all(system.behavior(name).received for name in names))
        assert [system.behavior(name).received for name in names] == [[1], [1], [1]]


OVERRIDDEN = """
system: overridden
delivery: {whole}
nodes:
  source:
    behavior: table:Source
    publishers: {{one: {{type: std_msgs/msg/Int64}}, two: {{type: std_msgs/msg/Int64}}}}
  one: {{behavior: table:Sink, subscriptions: {{input: {{type: std_msgs/msg/Int64}}}}}}
  two: {{behavior: table:Sink, subscriptions: {{input: {{type: std_msgs/msg/Int64}}}}}}
connections:
  - {{topic: /one, from: source.one, to: one.input, delivery: {one}}}
  - {{topic: /two, from: source.two, to: two.input}}
"""


@pytest.mark.parametrize(("whole", "one"), [("auto", "dds"), ("dds", "auto")])
def test_a_connection_overrides_the_system(tmp_path: Path, whole: str, one: str) -> None:
    text = OVERRIDDEN.format(whole=whole, one=one)
    with running(text, tmp_path, table=MODULE) as system:
        source = system.node("source")
        source.loop.run(lambda: system.behavior("source").send(["one", "two"], 1))
        sinks = [system.behavior(name) for name in ("one", "two")]
        wait_until(lambda: all(sink.received for sink in sinks))
        same = [
            sink.received[0] is sent
            for sink, sent in zip(sinks, system.behavior("source").sent, strict=True)
        ]
        assert same == [one == "auto", whole == "auto"]
