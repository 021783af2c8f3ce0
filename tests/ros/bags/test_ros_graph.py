"""Topics of the ROS graph are recorded, by subscriptions."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.service_introspection import ServiceIntrospectionState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.bags.bag import BagError
from composer.bags.graph_recording import GraphRecording
from composer.bags.reader import open_bag
from composer.bags.recorder import Recorder
from composer.bags.writer import BagWriter
from composer.client.session import Deadline, Session
from composer.runtime.clock.clock import COMPUTER
from tests.ros.bags.test_recording import calls_of_service, decoded_data
from tests.ros.support.commands import start
from tests.ros.support.in_process import Peer, wait_until


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
    monkeypatch.setattr("composer.bags.graph_recording.MAX_TOPICS", 1)
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
