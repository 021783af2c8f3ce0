"""Recording from inside of a system, and of the ROS graph; bags as commands change them."""

from __future__ import annotations

import signal
from itertools import pairwise
from pathlib import Path

import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.highlevel import AnyReader
from std_msgs.msg import String

from composer.bags.bag import BagError, BagMessage, BagTopic
from composer.bags.reader import open_bag
from composer.bags.recorder import Recorder
from composer.runtime.clock.clock import COMPUTER
from tests.ros.support.commands import compose, error, output_of, running, start
from tests.ros.support.in_process import Peer

COUNTING = """\
system: counting
recording: {{folder: {folder}, topics: [/numbers, "/m*", /nambers], exclude: [/mute], {more}}}
nodes:
  counter:
    behavior: counter:Counter
    publishers:
      numbers: {{type: std_msgs/msg/Int32, topic: /numbers, qos: command}}
      map: {{type: std_msgs/msg/String, topic: /map, qos: state}}
      mute: {{type: std_msgs/msg/String, topic: /mute, qos: state}}
      other: {{type: std_msgs/msg/String, topic: /other, qos: state}}
    timers:
      tick: {{rate_hz: 100.0}}
    services:
      fail: {{type: std_srvs/srv/Trigger, service: /fail}}
"""
BEHAVIOR = """\
from composer.behavior import Behavior
from std_msgs.msg import Int32, String

class Counter(Behavior):
    def on_activate(self):
        self.number = 0
        self.publishers["map"].publish(String(data="the map"))
        self.publishers["mute"].publish(String())

    def on_tick(self):
        self.number += 1
        self.publishers["numbers"].publish(Int32(data=self.number))

    def on_fail(self, request, response):
        self.fail("requested")
        return response
"""


@pytest.fixture
def bags(tmp_path: Path) -> Path:
    """The folder of the recordings of ``counting.yaml``."""
    (tmp_path / "counter.py").write_text(BEHAVIOR, encoding="utf-8")
    return tmp_path / "bags"


def _system(bags: Path, more: str = "") -> Path:
    path = bags.parent / "counting.yaml"
    path.write_text(COUNTING.format(folder=bags, more=more), encoding="utf-8")
    return path


def _decoded(folder: Path, topic: str) -> list[object]:
    """Return the values on a topic, as another library reads them, without our definitions."""
    with AnyReader([folder]) as reader:
        connections = [item for item in reader.connections if item.topic == topic]
        return [
            reader.deserialize(data, item.msgtype).data
            for item, _, data in reader.messages(connections)
        ]


def test_a_system_records_itself(bags: Path) -> None:
    path = _system(bags, "split_s: 2")
    output_of("run", path, "--time", "virtual", "--for", "5")
    [folder] = bags.iterdir()
    assert _decoded(folder, "/numbers") == list(range(1, 501))
    assert _decoded(folder, "/map") == ["the map"]
    bag = open_bag(folder)
    assert set(bag.summary.topics) == {"/numbers", "/map"}
    assert len(bag.files) == 3
    times = [item.recorded_ns for item in bag.messages(frozenset({"/numbers"}), 0, 2**62)]
    assert {later - earlier for earlier, later in pairwise(times)} == {10**7}
    attached = {item.name: item.data for item in bag.attachments()}
    assert attached[str(path)] == path.read_bytes()
    shown = output_of("bag", "info", folder)
    assert "messages:  501" in shown

    part, whole = bags / "part", bags / "whole"
    output_of("bag", "slice", folder, "-o", part, "--start", "1", "--duration", "1")
    assert _decoded(part, "/numbers") == list(range(100, 200))
    rest = bags / "rest"
    output_of("bag", "slice", folder, "-o", rest, "--start", "2", "--topics", "/n*")
    output_of("bag", "merge", rest, part, "-o", whole)
    assert _decoded(whole, "/numbers") == list(range(100, 501))
    assert "the bags are equal" in output_of("bag", "diff", folder, folder)
    done = compose("bag", "diff", rest, whole)
    assert (done.returncode, done.stdout) == (
        1,
        "0.000000 s  /numbers  message 1: data: expected 200, found 100\n",
    )
    assert "no topic of the bag matches" in error(
        "bag", "slice", part, "-o", whole, "--topics", "x"
    )


def test_a_flight_recorder_writes_at_a_fault_and_on_request(bags: Path) -> None:
    path = _system(bags, "ring_s: 1.5")
    with running(bags.parent / "log", str(path)) as run:
        run.wait_for("1 of 1 nodes active")
        folder = Path(output_of("record", "counting", "--now").strip())
        numbers = _decoded(folder, "/numbers")
        assert numbers == list(range(numbers[0], numbers[-1] + 1))
        output_of("service", "call", "/fail", "std_srvs/srv/Trigger", "{}")
        run.wait_for("recorded the last seconds: ")
        [other] = [item for item in bags.iterdir() if item.name != folder.name]
        after = _decoded(other, "/numbers")
        assert after[0] > numbers[-1]  # each message is written once
        assert 0 < len(after) <= 200
        assert _decoded(other, "/map") == ["the map"]  # it was latched before
        attached = {item.name: item.data.decode() for item in open_bag(other).attachments()}
        assert "counter failed: requested" in attached["recording.json"]
        run.stop()


def test_what_cannot_be_recorded_is_named(bags: Path) -> None:
    bags.write_text("a file")
    assert f"cannot create {bags}" in error("run", _system(bags))
    assert f"cannot write to {bags}" in error("run", _system(bags, "ring_s: 1"))
    bags.unlink()
    with running(bags.parent / "log", str(_system(bags))) as run:
        run.wait_for("publishes '/nambers', which 'recording' lists; did you mean '/numbers'?")
        assert "it records all the time" in error("record", "counting", "--now")
        assert "already runs" in error("run", bags.parent / "counting.yaml")
        assert len(list(bags.iterdir())) == 1  # a run that does not start leaves no bag
        run.stop()


@pytest.fixture
def publishing(peer: Peer) -> Node:
    """Two publishers of one topic, one of them best effort, and a latched topic."""
    node = peer.node
    latched = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    map_publisher = node.create_publisher(String, "/map", latched)
    for number in range(3):
        map_publisher.publish(String(data=f"map {number}"))
    weak = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    for name, profile in (("a", QoSProfile(depth=1)), ("b", weak)):
        publisher = node.create_publisher(String, "/chatter", profile)
        node.create_timer(0.02, lambda name=name, to=publisher: to.publish(String(data=name)))
    return node


@pytest.mark.usefixtures("publishing")
def test_the_graph_is_recorded(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    process = start("record", "-o", str(folder), "--topics", "/map", "--topics", "/chat*")
    while True:  # what was written can be read at any time
        try:
            found = set(open_bag(folder).summary.counts)
        except BagError:
            found = set()
        if found == {"/map", "/chatter"} and process.poll() is None:
            break
        assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    output, text = process.communicate(timeout=60.0)
    assert process.returncode == 0, text
    assert f" 0 dropped: {folder}\n" in output
    assert _decoded(folder, "/map") == ["map 0", "map 1", "map 2"]
    assert set(_decoded(folder, "/chatter")) == {"a", "b"}
    topics = open_bag(folder).summary.topics
    assert [item.durability for item in topics["/map"].qos] == ["transient_local"]
    assert {item.reliability for item in topics["/chatter"].qos} == {"reliable", "best_effort"}
    assert topics["/map"].type_hash.startswith("RIHS01_")


class _FullDisk:
    """A sink that fails after some messages."""

    def __init__(self, count: int) -> None:
        self.written: list[BagMessage] = []
        self._count = count

    def add_topic(self, topic: BagTopic) -> None:
        pass

    def write(self, message: BagMessage) -> None:
        if len(self.written) == self._count:
            raise BagError("the disk is full")
        self.written.append(message)

    def flush_if_due(self) -> None:
        pass

    def close(self) -> None:
        pass


def test_a_full_disk_does_not_stop_publishers() -> None:
    sink = _FullDisk(10)
    recorder = Recorder(sink, COMPUTER)
    source = recorder.source(BagTopic("/chat", "std_msgs/msg/String"))
    with recorder:
        for number in range(30):
            source.put(String(data=str(number)))
    assert recorder.problem == "the disk is full"
    assert len(sink.written) == 10


def test_drops_are_counted() -> None:
    sink = _FullDisk(10**6)
    recorder = Recorder(sink, COMPUTER)  # whose thread does not run yet
    source = recorder.source(BagTopic("/chat", "std_msgs/msg/String"))
    for number in range(10_100):
        source.put(String(data=str(number)))
    assert recorder.dropped == 100
    with recorder:
        pass
    assert len(sink.written) == 10_000
