"""In-process delivery has the same semantics as DDS: one table for both."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nav_msgs.msg
import pytest
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import Image, Imu, JointState, LaserScan
from std_msgs.msg import Header, String

from composer.model import LogLevel
from composer.runtime.host_options import HostOptions
from composer.runtime.intra_process.publisher import copy_of
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


ISOLATED = """
system: isolated
nodes:
  source:
    behavior: isolated:Source
    publishers:
      shared: {type: std_msgs/msg/Int64}
      copied: {type: std_msgs/msg/Int64}
      by_dds: {type: std_msgs/msg/Int64}
      latched: {type: std_msgs/msg/Int64, qos: state}
  shared: {behavior: isolated:Changer, subscriptions: {input: {type: std_msgs/msg/Int64}}}
  first: {behavior: isolated:Changer, subscriptions: {input: {type: std_msgs/msg/Int64}}}
  second: {behavior: isolated:Changer, subscriptions: {input: {type: std_msgs/msg/Int64}}}
  by_dds: {behavior: isolated:Changer, subscriptions: {input: {type: std_msgs/msg/Int64}}}
  late:
    behavior: isolated:Changer
    lifecycle: {autostart: unconfigured}
    subscriptions: {input: {type: std_msgs/msg/Int64, qos: state}}
connections:
  - {topic: /shared, from: source.shared, to: shared.input}
  - {topic: /copied, from: source.copied, to: [first.input, second.input], isolation: copy}
  - {topic: /by_dds, from: source.by_dds, to: by_dds.input, delivery: dds}
  - {topic: /latched, from: source.latched, to: late.input, isolation: copy}
"""
CHANGERS = """
from composer.behavior import Behavior
from std_msgs.msg import Int64

class Source(Behavior):
    def send(self):
        for name in ("shared", "copied", "by_dds", "latched"):
            message = Int64(data=1)
            self.publishers[name].publish(message)
            message.data = 2

class Changer(Behavior):
    def on_configure(self):
        self.received = []

    def on_input(self, message):
        self.received.append(message.data)
        message.data = 9
"""


def test_a_connection_may_require_a_copy_for_each_receiver_or_dds(tmp_path: Path) -> None:
    options = HostOptions(log_level=LogLevel.DEBUG)
    with running(ISOLATED, tmp_path, options=options, isolated=CHANGERS) as system:
        system.node("source").loop.run(system.behavior("source").send)
        system.change("late", "configure", "activate")
        names = ("shared", "first", "second", "by_dds", "late")
        wait_until(lambda: all(system.behavior(name).received for name in names))
        received = [system.behavior(name).received for name in names]
    assert received == [[2], [1], [1], [1], [1]]
    said = [line for line in system.log() if "uses DDS only" in line]
    assert said == [
        f"{end} uses DDS only: 'delivery: dds' is set"
        for end in ("publisher 'by_dds'", "subscription 'input'")
    ]


OVERRIDDEN = """
system: overridden
delivery: dds
nodes:
  source:
    behavior: table:Source
    publishers: {one: {type: std_msgs/msg/Int64}, two: {type: std_msgs/msg/Int64}}
  one: {behavior: table:Sink, subscriptions: {input: {type: std_msgs/msg/Int64}}}
  two: {behavior: table:Sink, subscriptions: {input: {type: std_msgs/msg/Int64}}}
connections:
  - {topic: /one, from: source.one, to: one.input, delivery: auto}
  - {topic: /two, from: source.two, to: two.input}
"""


def test_a_connection_overrides_the_system(tmp_path: Path) -> None:
    with running(OVERRIDDEN, tmp_path, table=MODULE) as system:
        source = system.behavior("source")
        system.node("source").loop.run(lambda: source.send(["one", "two"], 1))
        one, two = (system.behavior(name) for name in ("one", "two"))
        wait_until(lambda: one.received and two.received)
        assert one.received[0] is source.sent[0]
        assert two.received[0] is not source.sent[1]


MESSAGES = [
    String(data="text"),
    Image(header=Header(frame_id="camera"), data=bytes(range(256))),
    Imu(orientation_covariance=[float(number) for number in range(9)]),
    LaserScan(ranges=[1.0, 2.0]),
    JointState(name=["left", "right"], position=[1.0, 2.0]),
    nav_msgs.msg.Path(poses=[PoseStamped(), PoseStamped(header=Header(frame_id="map"))]),
    nav_msgs.msg.Path(poses=(PoseStamped(),)),
]


def parts(value: Any) -> list[object]:
    """Return all mutable parts of a message."""
    if isinstance(value, str | bytes | int | float):
        return []
    if hasattr(value, "get_fields_and_field_types"):
        inner = [getattr(value, name) for name in value.get_fields_and_field_types()]
    else:
        inner = list(value)
    return [value, *(part for item in inner for part in parts(item))]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_a_copy_is_equal_and_shares_nothing_mutable(message: Any) -> None:
    copy = copy_of(message)
    assert copy == message
    assert type(copy) is type(message)
    shared = {id(part) for part in parts(message)} & {id(part) for part in parts(copy)}
    assert not shared
