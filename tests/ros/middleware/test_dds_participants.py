"""Processes discover each other at once, know of missing participants, and use the profiles."""

from __future__ import annotations

import json
import os
import re
import subprocess
import time
from contextlib import closing
from pathlib import Path

import pytest
from rclpy.context import Context
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo
from sensor_msgs.msg import Image, Range
from std_msgs.msg import Empty, String

from composer.runtime.middleware.local_resources import (
    LARGE_SEGMENT_BYTES,
    count_participants,
    ended_participants,
)
from composer.runtime.ros.graph import UNKNOWN_NODE, RosGraph, participant
from tests.ros.support.commands import compose, hand_written, running
from tests.ros.support.forked import ForkedProgram
from tests.ros.support.in_process import Peer, wait_until
from tests.ros.support.raw_rmw import NodeNames, own_prefix
from tests.ros.support.system_process import write_system

#: A participant that is not discovered at once is discovered 1 to 3 s later; without the profile,
#: that is every second one. The share allows for delays on a busy machine.
JOINS, ENOUGH = 16, 12
AT_ONCE_S = 0.9
ATTEMPTS = 5
#: The lease of a command is 4 s. With the default of 20 s, it would be known for 17 s at least.
FORGOTTEN_WITHIN_S = 15.0
#: Enough for several packets.
TOPICS = [f"/flood/topic_{number}" for number in range(250)]
JOIN = f"""
import json, time
from composer.runtime.middleware.environment import prepare_environment
prepare_environment()
from composer.client.graph_names import GraphNames
from composer.client.session import Deadline, Session

took_s, missing = [], []
for _ in range({JOINS}):
    with Session() as session:
        began_s = time.monotonic()
        session.wait_for(lambda: session.graph.others() or None, Deadline(10.0))
        took_s.append(time.monotonic() - began_s)
        found = dict(GraphNames(session, Deadline(10.0)).names("topic"))
        missing.append(sum(topic not in found for topic in {TOPICS}))
print(json.dumps([took_s, missing]))
"""
#: Print the UDP ports and the shared memory of Fast DDS that a command uses.
PRINT_TRANSPORTS = """
import json, os, re
from pathlib import Path
from composer.runtime.middleware.environment import prepare_environment
prepare_environment()
from composer.client.session import Deadline, Session, use_command_profile

use_command_profile()
with Session() as session:
    session.wait_for(lambda: session.graph.others() or None, Deadline(10.0))
    sockets = {os.readlink(path) for path in Path("/proc/self/fd").iterdir() if path.is_socket()}
    rows = [row.split() for row in Path("/proc/net/udp").read_text().splitlines()[1:]]
    ports = [int(row[1].rpartition(":")[2], 16) for row in rows if f"socket:[{row[9]}]" in sockets]
    shared = re.findall("/dev/shm/fast.*", Path("/proc/self/maps").read_text())
    print(json.dumps([session.graph.others(), ports, shared]))
"""


def shared_memory() -> set[str]:
    """Return Fast DDS's files in shared memory that this process has mapped."""
    return set(re.findall("/dev/shm/fast.*", Path("/proc/self/maps").read_text(encoding="utf-8")))


def output_of(folder: Path, code: str, *arguments: str) -> str:
    """Run a program with the environment of a command; return the last line that it prints."""
    program = folder / "program.py"
    program.write_text(code, encoding="utf-8")
    process = ForkedProgram(program, *arguments, chooses_profile=True)
    printed, _ = process.communicate(timeout=60.0)
    assert process.returncode == 0, printed
    assert "XML" not in printed  # printed if the profile is invalid
    return printed.splitlines()[-1]


def test_nodes_of_tests_do_not_use_shared_memory(request: pytest.FixtureRequest) -> None:
    """Next to a killed process, they would occasionally crash or hang when destroyed."""
    before = shared_memory()  # of tests that take part in a discovery of this computer
    peer: Peer = request.getfixturevalue("peer")
    assert peer.node.get_node_names()
    assert shared_memory() <= before


@pytest.mark.timeout(200)
def test_a_new_process_discovers_others_with_all_topics_at_once(
    tmp_path: Path, peer: Peer, capfd: pytest.CaptureFixture[str]
) -> None:
    for topic in TOPICS:
        peer.node.create_publisher(Empty, topic, 1)
    attempts = []
    for _ in range(ATTEMPTS):
        took_s, missing = json.loads(output_of(tmp_path, JOIN))
        assert "XML" not in capfd.readouterr().err
        if sum(join_s < AT_ONCE_S for join_s in took_s) >= ENOUGH <= missing.count(0):
            return
        attempts.append((took_s, missing))
    raise AssertionError(f"discovery took longer: {attempts}")


def test_each_participant_on_this_host_is_counted(peer: Peer) -> None:
    domain_id = int(os.environ["ROS_DOMAIN_ID"])
    # While other sockets of the computer are closed, Linux may leave rows out of its table.
    before = wait_until(lambda: count_participants(domain_id), "the participant of the peer")
    with closing(Peer()):
        wait_until(lambda: count_participants(domain_id) == before + 1, "another one")
    wait_until(lambda: count_participants(domain_id) == before, "its end")


def test_participants_of_ended_processes_are_recognized(peer: Peer) -> None:
    domain_id = int(os.environ["ROS_DOMAIN_ID"])
    graph = RosGraph(peer.node)
    wait_until(lambda: len(graph.participants()) == count_participants(domain_id))
    known = graph.participants()
    assert ended_participants(known, domain_id) == frozenset()
    (own,) = (prefix for prefix in known if prefix[4:6] == number(os.getpid()))
    with subprocess.Popen(["true"]) as process:
        process.wait()
    ended = own[:4] + number(process.pid) + own[6:]
    elsewhere = own[:2] + bytes(255 - byte for byte in own[2:4]) + ended[4:]
    assert ended_participants(known | {ended, elsewhere}, domain_id) == {ended}
    # It may run in a container, if another participant holds a port.
    with closing(Peer()):
        assert ended_participants(known | {ended}, domain_id) == frozenset()


class Observer(Node):
    """Has not received the names of the nodes of one process."""

    missed = -1

    def get_publishers_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]:
        found = super().get_publishers_info_by_topic(topic_name, no_mangle)
        for endpoint in found:
            if participant(endpoint)[4:6] == number(self.missed):
                endpoint.node_name = UNKNOWN_NODE
        return found


def test_the_nodes_of_a_killed_process_are_not_waited_for(ros_domain_id: int) -> None:
    """It will never announce their names."""
    with Context() as context, hand_written("hand_written_talker.py") as talker:
        observer = Observer("observer", context=context)
        graph = RosGraph(observer)
        wait_until(lambda: ("talker", "/lab") in graph.nodes() and graph.are_nodes_known())
        observer.missed = talker.pid
        assert not graph.are_nodes_known()
        talker.kill()
        talker.wait()
        wait_until(graph.are_nodes_known)
        assert ("talker", "/lab") in graph.nodes()
        observer.destroy_node()


def test_nodes_announced_after_the_end_of_their_participant_do_not_count(
    ros_domain_id: int,
) -> None:
    """rmw lists them for good. They run again in another process, so each would be listed twice."""
    with Context() as context, Context() as another:
        graph, late = Node("graph", context=context), Node("late", context=another)
        ended = bytes(byte ^ 1 for byte in own_prefix(late))
        names = NodeNames(late, ended, [("/", "late")])

        def is_announced() -> bool:
            names.announce()
            return graph.get_node_names().count("late") == 2

        wait_until(is_announced)
        found = RosGraph(graph)
        assert [name for name, _ in found.nodes()] == ["graph", "late"]
        for node in (graph, late):
            node.destroy_node()


def number(process: int) -> bytes:
    return (process & 0xFFFF).to_bytes(2, "little")


def test_a_command_discovers_others_without_shared_memory_and_is_forgotten_soon(
    tmp_path: Path, peer: Peer
) -> None:
    def participants() -> int:
        return len(peer.node.get_publishers_info_by_topic("ros_discovery_info", no_mangle=True))

    before = participants()
    multicast = 7400 + 250 * int(os.environ["ROS_DOMAIN_ID"])
    for _ in range(3):  # most of their goodbye messages are lost
        others, ports, shared = json.loads(output_of(tmp_path, PRINT_TRANSPORTS))
        assert [peer.node.get_name(), peer.node.get_namespace()] in others
        assert shared == []
        assert ports
        assert multicast not in ports
    ended_s = time.monotonic()
    wait_until(lambda: participants() <= before, "their end")
    assert time.monotonic() - ended_s < FORGOTTEN_WITHIN_S


MESSAGES = 4000
#: Publish to another process, and print how often the timer thread of Fast DDS slept meanwhile.
PUBLISH = f"""
import json, os, sys, time
from pathlib import Path
from composer.runtime.middleware.environment import prepare_environment
prepare_environment()
import rclpy
from std_msgs.msg import String

def sleeps():
    tasks = [task for task in Path("/proc/self/task").iterdir()
             if (task / "comm").read_text().startswith("dds.ev")]
    assert len(tasks) == 1, tasks
    status = dict(line.split(":", 1) for line in (tasks[0] / "status").read_text().splitlines())
    return int(status["voluntary_ctxt_switches"])

rclpy.init()
node = rclpy.create_node("publisher")
publisher = node.create_publisher(String, sys.argv[1], 10)
until_s = time.monotonic() + 30.0
while not publisher.get_subscription_count():
    assert time.monotonic() < until_s, "no subscription"
    time.sleep(0.01)  # poll
before, began_s = sleeps(), time.monotonic()
for number in range({MESSAGES}):
    publisher.publish(String(data=str(number)))
    next_s = time.monotonic() + 0.0002
    while time.monotonic() < next_s:
        pass
print(json.dumps([sleeps() - before, time.monotonic() - began_s]), flush=True)
os._exit(0)
"""


def test_no_thread_wakes_after_each_message(
    tmp_path: Path, peer: Peer, capfd: pytest.CaptureFixture[str]
) -> None:
    received: list[String] = []
    peer.node.create_subscription(String, "/texts", received.append, 10)
    slept, took_s = json.loads(output_of(tmp_path, PUBLISH, "/texts"))
    assert received
    assert "XML" not in capfd.readouterr().err
    # A few times in 4 ms; by default twice for each of the 5000 messages in a second.
    assert 0 < slept < 2000.0 * took_s


SYSTEM = """
system: camera
nodes:
  sensor:
    timers: {tick: {period_ms: 20, publish: {out: {}}}}
    publishers: {out: {type: %s, external: true}}
"""


def segment_bytes(pid: int) -> list[int]:
    """Return the sizes of the segments of Fast DDS that a process has mapped."""
    maps = Path(f"/proc/{pid}/maps").read_text()
    found = re.findall(r"(?m)^(\w+)-(\w+) .*/dev/shm/fastrtps_[0-9a-f]+$", maps)
    return [int(end, 16) - int(start, 16) for start, end in found]


@pytest.mark.parametrize(
    ("discovery_range", "kind"), [("SUBNET", Image), ("LOCALHOST", Image), ("LOCALHOST", Range)]
)
def test_a_system_with_a_camera_has_a_large_segment(
    discovery_range: str, kind: type, tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", discovery_range)
    path = write_system(tmp_path, SYSTEM % f"sensor_msgs/msg/{kind.__name__}")
    with running(tmp_path / "log", str(path)) as system:
        system.wait_for("1 of 1 nodes active")
        largest = max(segment_bytes(system.process.pid))
        if kind is Image:
            assert largest >= LARGE_SEGMENT_BYTES
        else:
            assert 0 < largest < LARGE_SEGMENT_BYTES / 10
        received = peer.listen(kind, "/out")
        wait_until(lambda: received, "a message")  # the profile allows discovery and delivery
        assert {"/camera/manager", "/sensor"} <= set(compose("node", "list").stdout.split())
        code, _, log = system.stop()
    assert code == 0
    assert "XMLPARSER" not in log
