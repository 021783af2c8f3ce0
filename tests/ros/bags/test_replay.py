"""Replay into a system in virtual time and to the ROS graph, and recording of the graph."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.service_introspection import ServiceIntrospectionState
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.bags.bag import BagError, BagMessage, BagTopic
from composer.bags.comparing import Tolerances
from composer.bags.editing import Selection
from composer.bags.reader import open_bag
from composer.bags.recorder import Recorder
from composer.bags.ros_graph import GraphRecording
from composer.bags.writer import BagWriter
from composer.client.session import Deadline, Session
from composer.model.qos import PRESETS
from composer.runtime.clock import COMPUTER
from composer.testing.bag_replay import Replay, replay, without_nodes
from composer.testing.declarations import load_file
from tests.ros.bags.test_recording import calls_of_service, decoded_data
from tests.ros.support.commands import compose, error, finished, output_of, start
from tests.ros.support.forked import ForkedCommand
from tests.ros.support.in_process import PATIENCE_S, Peer, wait_until

SYSTEMS = Path(__file__).parents[3] / "systems"
PIPELINE = SYSTEMS / "pipeline.yaml"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five seconds of the pipeline."""
    folder = tmp_path_factory.mktemp("bags")
    finished(
        ForkedCommand(
            *("run", str(PIPELINE), "--record", "--time", "virtual", "--for", "5"), cwd=folder
        )
    )
    [bag] = (folder / "bags").iterdir()
    return bag


def _replayed(bag: Path, **settings: float) -> Replay:
    named = {f"motor_controller.{name}": value for name, value in settings.items()}
    system = without_nodes(load_file(PIPELINE, {}, named)[0], ["sensor_*"])
    return replay(system, open_bag(bag), Selection())


@pytest.mark.parametrize(
    "runs", [5, pytest.param(50, marks=[pytest.mark.soak, pytest.mark.timeout(900)])]
)
def test_the_commands_are_the_same_each_time(recorded: Path, runs: int) -> None:
    golden = open_bag(recorded)
    for _ in range(runs):
        done = _replayed(recorded)
        assert done.differences(golden, Tolerances(time_s=0.0)) == []
        assert len(done.played) == golden.summary.counts["/sensor_data"]
        assert len(done.messages) >= golden.summary.counts["/motor_commands"] - 2


def test_the_first_difference_is_named(recorded: Path, tmp_path: Path) -> None:
    done = _replayed(recorded, position_gain=1.4)
    golden = open_bag(recorded)
    [found] = done.differences(golden, Tolerances(value=1e-6))
    assert found.topic == "/motor_commands"
    assert found.text.startswith("linear.x: expected ")
    assert "; after message " in found.text
    assert done.differences(golden, Tolerances(value=10.0)) == []
    assert done.differences(golden, Tolerances(ignored=("linear.*",))) == []
    with pytest.raises(BagError, match="no topic that the system publishes"):
        done.differences(open_bag(_chat(tmp_path)), Tolerances())


def test_the_command(recorded: Path, tmp_path: Path) -> None:
    words = ("replay", recorded, "pipeline", "--replace", "sensor_simulator")
    golden = tmp_path / "golden"
    assert "equal to the messages of the bag" in output_of(
        *words, "--compare", recorded, "-o", golden
    )
    assert "equal to the messages of the bag" in output_of(*words, "--compare", golden)
    done = compose(*words, "--compare", golden, "--set", "motor_controller.max_velocity=0.5")
    assert (done.returncode, done.stdout.count("/motor_commands")) == (1, 1)
    assert "only receives" in error(*words[:3])


def _chat(folder: Path, name: str = "chat", type_name: str = "std_msgs/msg/String") -> Path:
    """Write a bag with a latched message and 50 others, one each 10 ms."""
    writer = BagWriter(folder / name)
    writer.add_topic(BagTopic("/map", type_name, (PRESETS["state"],)))
    writer.add_topic(BagTopic("/chat", type_name, (PRESETS["command"],)))
    for number in range(51):
        at_ns = 10**18 + number * 10**7
        data = b"\x00\x01\x00\x00\x03\x00\x00\x00%02d\x00" % number
        writer.write(BagMessage("/chat" if number else "/map", at_ns, at_ns, data))
    writer.close()
    return folder / name


def test_the_graph_receives_a_bag(tmp_path: Path, peer: Peer) -> None:
    got: list[str] = []
    times: list[int] = []
    ended = threading.Event()

    def on_chat(message: String) -> None:
        got.append(message.data)
        if message.data == "50":
            ended.set()

    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    maps: list[str] = []
    peer.node.create_subscription(String, "/talk", on_chat, 100)
    peer.node.create_subscription(String, "/map", lambda item: maps.append(item.data), latched)
    peer.node.create_subscription(Clock, "/clock", lambda item: times.append(item.clock.sec), 100)
    words = ("--remap", "/chat:=/talk", "--clock", "--rate", "0.5")
    process = start("replay", str(_chat(tmp_path)), *words)
    assert ended.wait(60.0)
    output, text = process.communicate(timeout=60.0)
    assert (process.returncode, output) == (0, "51 messages\n"), text
    assert got == [f"{number:02d}" for number in range(1, 51)]
    assert maps == ["00"]
    assert set(times) == {10**9}


def test_the_space_key_pauses(tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    # setsid makes the terminal theirs: in the background, a program reads no keys.
    words = ("setsid", "--ctty", sys.executable, "-m", "composer", "replay", "--rate", "0.1")
    text = ""

    def wait_for(part: str) -> None:
        nonlocal text
        until_s = time.monotonic() + PATIENCE_S
        while part not in text:
            assert time.monotonic() < until_s, text
            if select.select([ours], [], [], 0.1)[0]:
                text += os.read(ours, 1000).decode()
        text = text.partition(part)[2]

    with subprocess.Popen(
        (*words, str(_chat(tmp_path))), stdin=theirs, stdout=subprocess.PIPE, stderr=theirs
    ) as process:
        os.close(theirs)
        try:
            wait_for("0 of 0 s (space pauses)")
            os.write(ours, b" ")
            wait_for("0 of 0 s, paused (space resumes)")
            os.write(ours, b" ")
            wait_for("0 of 0 s (space pauses)")
            os.write(ours, b"\x03")
            output, _ = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
            os.close(ours)
    assert (process.returncode, output.endswith(b" messages\n")) == (0, True)


#: Options of ``compose replay`` with a bag, and what is wrong.
MISTAKES = {
    ("--topics", "/chit"): "no topic of the bag matches",
    ("--compare", "golden"): "--compare can only be used with SYSTEM",
    ("pipeline", "--loop"): "--loop can only be used without SYSTEM",
    ("--remap", "chat"): "--remap takes /OLD:=/NEW",
}
#: Topics and times that the ROS graph cannot have.
IMPOSSIBLE = (
    ("bad name!\x1b[31m", 1, "topic name '/bad name!\\x1b[31m' contains a space"),
    ("/" + "x" * 3000, 1, "' has 3001 characters"),
    ("/chat", 2**62, "from after 2038, which /clock cannot show"),
)


def test_mistakes(tmp_path: Path) -> None:
    bag = _chat(tmp_path)
    for options, text in MISTAKES.items():
        done = compose("replay", bag, *options)
        assert done.returncode in {1, 2}
        assert text in done.stderr
    for number, (topic, at_ns, text) in enumerate(IMPOSSIBLE):
        writer = BagWriter(tmp_path / f"bag_{number}")
        writer.add_topic(BagTopic(topic, "std_msgs/msg/String"))
        writer.write(BagMessage(topic, at_ns, at_ns, bytes(8)))
        writer.close()
        assert text in error("replay", tmp_path / f"bag_{number}", "--clock")


def test_a_type_that_is_not_installed_is_named(tmp_path: Path) -> None:
    bag = _chat(tmp_path, type_name="missing_msgs/msg/Chat")
    assert "interface 'missing_msgs/msg/Chat' is not installed" in error("replay", bag)
    with pytest.raises(BagError, match="has no node 'x'"):
        without_nodes(load_file(PIPELINE, {}, {})[0], ["x"])


@pytest.fixture
def publishing(peer: Peer) -> Node:
    """Two publishers of one topic, one of them best effort, a latched topic, and a service."""
    node = peer.node
    latched = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    map_publisher = node.create_publisher(String, "/map", latched)
    for number in range(3):
        map_publisher.publish(String(data=f"map {number}"))
    weak = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    for name, profile in (("a", QoSProfile(depth=1)), ("b", weak)):
        publisher = node.create_publisher(String, "/chatter", profile)
        node.create_timer(0.02, lambda name=name, to=publisher: to.publish(String(data=name)))
    service = node.create_service(Trigger, "/introspected", lambda _, response: response)
    contents = ServiceIntrospectionState.CONTENTS
    service.configure_introspection(node.get_clock(), QoSProfile(depth=10), contents)
    client = node.create_client(Trigger, "/introspected")
    node.create_timer(0.05, lambda: client.call_async(Trigger.Request()))
    return node


@pytest.mark.usefixtures("publishing")
def test_the_graph_is_recorded(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    patterns = ("--topics", "/map", "--topics", "/chat*", "--services", "/intro*")
    process = start("record", "-o", str(folder), *patterns)
    while True:  # what was written can be read at any time
        try:
            found = set(open_bag(folder).summary.counts)
        except BagError:
            found = set()
        if found == {"/map", "/chatter", "/introspected/_service_event"} and process.poll() is None:
            break
        assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    output, text = process.communicate(timeout=60.0)
    assert process.returncode == 0, text
    assert f" 0 dropped: {folder}\n" in output
    assert decoded_data(folder, "/map") == ["map 0", "map 1", "map 2"]
    assert set(decoded_data(folder, "/chatter")) == {"a", "b"}
    bag = open_bag(folder)
    assert {kind for kind, *_ in calls_of_service(bag, "/introspected")} == {1, 2}
    topics = bag.summary.topics
    assert [item.durability for item in topics["/map"].qos] == ["transient_local"]
    assert {item.reliability for item in topics["/chatter"].qos} == {"reliable", "best_effort"}
    assert topics["/map"].type_hash.startswith("RIHS01_")


@pytest.mark.usefixtures("publishing")
def test_the_number_of_topics_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("composer.bags.ros_graph.MAX_TOPICS", 1)
    warnings: list[str] = []
    writer = BagWriter(tmp_path / "bag")
    with Session() as session, Recorder(writer, COMPUTER) as recorder:
        recording = GraphRecording(session, recorder, lambda _: True, warnings.append)

        def is_limited() -> bool:
            session.spin_once(Deadline(0.1))
            recording.update()
            return bool(warnings)

        wait_until(is_limited, "the limit")
        recording.update()
        assert recording.topics == 1
        recording.close()
    assert warnings == ["there are more than 1 topics: no further ones are recorded"]
