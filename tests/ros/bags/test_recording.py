"""Recording from inside of a system, and of the ROS graph; bags as commands change them."""

from __future__ import annotations

import threading
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from std_msgs.msg import String

from composer.bags.bag import Bag, BagError, BagMessage, BagTopic
from composer.bags.comparing import decoded
from composer.bags.reader import open_bag
from composer.bags.recorder import Recorder
from composer.runtime.clock import COMPUTER
from tests.ros.support.commands import compose, error, finished, output_of, running
from tests.ros.support.forked import ForkedCommand
from tests.ros.support.in_process import PATIENCE_S, wait_until

COUNTING = """\
system: counting
recording: {{folder: {folder}, topics: [/numbers, "/m*"], exclude: [/mute], {more}}}
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


def decoded_data(folder: Path, topic: str) -> list[object]:
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
    assert decoded_data(folder, "/numbers") == list(range(1, 501))
    assert decoded_data(folder, "/map") == ["the map"]
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
    assert decoded_data(part, "/numbers") == list(range(100, 200))
    rest = bags / "rest"
    output_of("bag", "slice", folder, "-o", rest, "--start", "2", "--topics", "/n*")
    output_of("bag", "merge", rest, part, "-o", whole)
    assert decoded_data(whole, "/numbers") == list(range(100, 501))
    assert "the bags are equal" in output_of("bag", "diff", folder, folder)
    done = compose("bag", "diff", rest, whole)
    assert (done.returncode, done.stdout) == (
        1,
        "0.000000 s  /numbers  message 1: data: expected 200, found 100\n",
    )
    assert "no topic of the bag matches" in error(
        "bag", "slice", part, "-o", whole, "--topics", "x"
    )


SELF_CALLING = """\
import rclpy
from composer_interfaces.action import Navigate
from rclpy.action import ActionClient, ActionServer
from rclpy.node import Node
from std_srvs.srv import SetBool

class SelfCalling(Node):
    def __init__(self):
        super().__init__("self_calling")
        self.declare_parameter("gain", 1.0)
        self.create_service(SetBool, "/enable", self.on_enable)
        self.client = self.create_client(SetBool, "/enable")
        self.server = ActionServer(self, Navigate, "/go", self.on_goal)
        self.goals = ActionClient(self, Navigate, "/go")
        self.timer = self.create_timer(0.01, self.begin)

    def begin(self):
        if self.client.service_is_ready() and self.goals.server_is_ready():
            self.timer.cancel()
            self.client.call_async(SetBool.Request(data=True)).add_done_callback(self.send)

    def on_enable(self, request, response):
        response.message = "enabled"
        return response

    def send(self, _):
        self.set_parameters([rclpy.Parameter("gain", value=2.0)])
        self.goals.send_goal_async(Navigate.Goal()).add_done_callback(self.follow)

    def follow(self, sent):
        sent.result().get_result_async().add_done_callback(self.end)

    def on_goal(self, goal):
        goal.publish_feedback(Navigate.Feedback())
        goal.succeed()
        return Navigate.Result()

    def end(self, _):
        self.get_logger().info("the goal has ended")
"""


def _recorded(bag: Bag, topic: str) -> list[Any]:
    """Return the messages of a topic, which another library reads by the definitions in the bag."""
    found = bag.summary.topics[topic]
    types = get_types_from_msg(found.definition, found.type_name)
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    name = next(iter(types))
    messages = []
    for message in bag.messages(frozenset({topic}), 0, 2**62):
        messages.append(decoded(message, found.type_name))
        if topic != "/parameter_events":  # whose padding is too long for this library
            copy = bytes(store.serialize_cdr(store.deserialize_cdr(message.data, name), name))
            assert decoded(message._replace(data=copy), found.type_name) == messages[-1]
    return messages


def calls_of_service(bag: Bag, name: str) -> list[tuple[int, int, Any]]:
    """Return the kinds, numbers and contents of the events of a service."""
    events = _recorded(bag, f"{name}/_service_event")
    return [
        (item.info.event_type, item.info.sequence_number, [*item.request, *item.response][0])
        for item in events
    ]


def test_everything_but_messages_is_recorded_in_virtual_time(tmp_path: Path) -> None:
    navigation = Path(__file__).parents[3] / "systems" / "navigation.yaml"
    words = ("run", str(navigation), "--record", "--time", "virtual", "--for", "5")
    finished(ForkedCommand(*words, cwd=tmp_path))
    [folder] = (tmp_path / "bags").iterdir()
    bag = open_bag(folder)
    goals = calls_of_service(bag, "/navigate/_action/send_goal")
    assert [kind for kind, *_ in goals] == [1, 2, 1, 2, 1, 2]
    assert sorted(content.accepted for _, _, content in goals[1::2]) == [False, True, True]
    results = calls_of_service(bag, "/navigate/_action/get_result")
    assert sorted(item.status for kind, _, item in results if kind == 2) == [4, 5]
    [_, (_, _, canceled)] = calls_of_service(bag, "/navigate/_action/cancel_goal")
    assert len(canceled.goals_canceling) == 1
    feedback = _recorded(bag, "/navigate/_action/feedback")
    accepted = {bytes(item.goal_id.uuid) for kind, _, item in results if kind == 1}
    assert {bytes(item.goal_id.uuid) for item in feedback} == accepted
    transitions = _recorded(bag, "/planning/navigator/transition_event")
    states = [item.goal_state.label for item in transitions]
    assert states[:4] == ["configuring", "inactive", "activating", "active"]
    assert states[-1] == "finalized"
    parameters = _recorded(bag, "/parameter_events")
    assert "max_velocity" in {item.new_parameters[0].name for item in parameters}
    assert {(item.stamp.sec, item.stamp.nanosec) for item in parameters} == {(10**9, 0)}
    assert any("rejects a goal" in line.msg for line in _recorded(bag, "/rosout"))


def test_calls_of_a_class_are_recorded(tmp_path: Path) -> None:
    (tmp_path / "self_calling.py").write_text(SELF_CALLING, encoding="utf-8")
    path = tmp_path / "own.yaml"
    path.write_text(
        "system: own\n"
        f"recording: {{folder: {tmp_path / 'bags'}, services: ['*'], actions: [/go],"
        " topics: [/parameter_events]}\n"
        "nodes: {own: {class: self_calling:SelfCalling}}\n",
        encoding="utf-8",
    )
    with running(tmp_path / "log", str(path)) as run:
        run.wait_for("the goal has ended")
        run.stop()
    [folder] = (tmp_path / "bags").iterdir()
    bag = open_bag(folder)
    assert "/rosout" not in bag.summary.topics
    calls = calls_of_service(bag, "/enable")
    assert sorted((kind, number) for kind, number, _ in calls) == [(0, 1), (1, 1), (2, 1), (3, 1)]
    assert [item.message for kind, _, item in calls if kind in (2, 3)] == ["enabled"] * 2
    [_, (_, _, response)] = calls_of_service(bag, "/go/_action/send_goal")
    [_, (_, _, result)] = calls_of_service(bag, "/go/_action/get_result")
    assert (response.accepted, result.status) == (True, 4)
    assert len(_recorded(bag, "/go/_action/feedback")) == 1
    changed = [item.changed_parameters for item in _recorded(bag, "/parameter_events")]
    assert [item.value.double_value for items in changed for item in items] == [2.0]


def test_a_flight_recorder_writes_at_a_fault_and_on_request(bags: Path) -> None:
    path = _system(bags, "ring_s: 1.5")
    with running(bags.parent / "log", str(path)) as run:
        run.wait_for("1 of 1 nodes active")
        folder = Path(output_of("record", "counting", "--now").strip())
        numbers = decoded_data(folder, "/numbers")
        assert numbers == list(range(numbers[0], numbers[-1] + 1))
        output_of("service", "call", "/fail", "std_srvs/srv/Trigger", "{}")
        run.wait_for("recorded the last seconds: ")
        [other] = [item for item in bags.iterdir() if item.name != folder.name]
        after = decoded_data(other, "/numbers")
        assert after[0] > numbers[-1]  # each message is written once
        assert 0 < len(after) <= 200
        assert decoded_data(other, "/map") == ["the map"]  # it was latched before
        attached = {item.name: item.data.decode() for item in open_bag(other).attachments()}
        assert "counter failed: requested" in attached["recording.json"]
        run.stop()


def test_what_cannot_be_recorded_is_named(bags: Path) -> None:
    bags.write_text("a file")
    assert f"cannot create {bags}" in error("run", _system(bags))
    assert f"cannot write to {bags}" in error("run", _system(bags, "ring_s: 1"))
    bags.unlink()
    with running(bags.parent / "log", str(_system(bags))) as run:
        run.wait_for("1 of 1 nodes active")
        assert "it records all the time" in error("record", "counting", "--now")
        assert "already runs" in error("run", bags.parent / "counting.yaml")
        assert len(list(bags.iterdir())) == 1  # a run that does not start leaves no bag
        run.stop()


class _Disk:
    """A sink that fails after some messages; a stalled one waits before it writes."""

    def __init__(self, fails_after: int = 10**6, *, is_stalled: bool = False) -> None:
        self.written: list[BagMessage] = []
        self.goes_on = threading.Event()
        self._fails_after = fails_after
        if not is_stalled:
            self.goes_on.set()

    def add_topic(self, topic: BagTopic) -> None:
        pass

    def write(self, message: BagMessage) -> None:
        assert self.goes_on.wait(PATIENCE_S)
        if len(self.written) == self._fails_after:
            raise BagError("the disk is full")
        self.written.append(message)

    def flush_if_due(self) -> None:
        pass

    def close(self) -> None:
        pass


def test_a_full_disk_does_not_stop_publishers() -> None:
    sink = _Disk(10)
    problems: list[str] = []
    recorder = Recorder(sink, COMPUTER, problems.append)
    source = recorder.source(BagTopic("/chat", "std_msgs/msg/String"))
    with recorder:
        for number in range(30):
            source.put(String(data=str(number)))
        wait_until(lambda: problems, "the report")
        source.put(String())
    assert problems == [recorder.problem] == ["the disk is full"]
    assert len(sink.written) == 10


def test_drops_are_counted() -> None:
    sink = _Disk()
    recorder = Recorder(sink, COMPUTER)  # whose thread does not run yet
    source = recorder.source(BagTopic("/chat", "std_msgs/msg/String"))
    for number in range(10_100):
        source.put(String(data=str(number)))
    assert recorder.dropped == 100
    with recorder:
        pass
    assert len(sink.written) == 10_000


def test_small_messages_that_wait_for_a_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python needs far more memory for them than for their bytes."""
    monkeypatch.setattr("composer.bags.recorder.LARGEST_PENDING_BYTES", 1_000_000)
    sink = _Disk(is_stalled=True)
    recorder = Recorder(sink, COMPUTER)
    source = recorder.source(BagTopic("/empty", "std_msgs/msg/Empty"))
    with recorder:
        for _ in range(9_000):
            source.put(b"1234")
        wait_until(lambda: recorder.dropped >= 3_000, "drops")
        sink.goes_on.set()
    assert len(sink.written) + recorder.dropped == 9_000


def test_a_stalled_disk_delays_no_node_and_costs_limited_memory() -> None:
    sink = _Disk(is_stalled=True)
    recorder = Recorder(sink, COMPUTER)
    source = recorder.source(BagTopic("/image", "sensor_msgs/msg/Image"))
    image = bytes(1_000_000)
    with recorder:
        for _ in range(1000):
            source.put(image)
        wait_until(lambda: recorder.dropped >= 700, "drops")
        other = recorder.source(BagTopic("/later", "std_msgs/msg/String"))
        other.put(String())
        sink.goes_on.set()
    assert recorder.problem is None
    assert 240 <= len(sink.written) <= 270
    assert len(sink.written) + recorder.dropped == 1001
