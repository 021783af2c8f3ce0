"""Computers of the tests on one network, and discovery if it does not forward multicast."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import pytest

from tests.ros.network.namespaces import PATIENCE_S, Computer, network, wait_until
from tests.ros.support.commands import PROGRAMS, Observer, observing

COMPOSE = (sys.executable, "-m", "composer")
SYSTEM = """
system: robot
discovery: {discovery}
{hosts}
nodes:
  camera:
    publishers: {{image: {{type: std_msgs/msg/String, qos: command}}}}
    timers: {{tick: {{period_ms: 50, publish: {{image: {{data: picture}}}}}}}}
  arm:
    subscriptions: {{image: {{type: std_msgs/msg/String, qos: command, log: "{{message.data}}"}}}}
    lifecycle: {{depends_on: [camera]}}
"""
HOSTS = """
hosts: {base: {address: 10.77.0.2, workspace: ~/robot}}
processes: {vision: {nodes: [camera], host: base}}
"""


@pytest.fixture(scope="module")
def computers() -> Iterator[list[Computer]]:
    with network(["robot", "base"]) as made:
        for computer in made:
            computer.block_multicast()
        yield made


@pytest.fixture
def write_system(tmp_path: Path) -> Callable[..., Path]:
    def write(discovery: str, hosts: str = "") -> Path:
        path = tmp_path / "robot.yaml"
        path.write_text(SYSTEM.format(discovery=discovery, hosts=hosts), encoding="utf-8")
        return path

    return write


@contextmanager
def run(computer: Computer, path: Path, *options: str) -> Iterator[Path]:
    """Run a system on a computer for the length of the block; yield its log."""
    log = path.with_name(f"{computer.name}.txt")
    with log.open("w") as file:
        process = computer.start(*COMPOSE, "run", str(path), *options, stderr=file)
    try:
        yield log
    finally:
        computer.kill_all()
        process.wait(PATIENCE_S)


def observe(computer: Computer, topic: str, *nodes: str) -> AbstractContextManager[Observer]:
    """Run an observer on a computer, without settings for discovery."""
    prefix = tuple(computer.command())
    return observing(topic, *nodes, environment=computer.environment(), prefix=prefix)


@pytest.mark.soak  # what one computer can show is in tests/ros/children
def test_peers_discover_each_other(
    computers: list[Computer], write_system: Callable[..., Path]
) -> None:
    robot, base = computers
    path = write_system(f"{{kind: peers, peers: [{base.address}]}}")
    with (
        run(robot, path) as log,
        observe(base, "/image", "arm", "camera") as peer,
        observe(robot, "/image", "arm", "camera") as local,
    ):
        peer.wait_until_ready()
        while peer.ask()[0] == 0:
            pass
        # It would know the other observer if it listed peers, or the network forwarded multicast.
        local.wait_until_ready()
        assert local.ask()[1] == ["arm", "camera", "manager", "observer"]
    variables = f"ROS_STATIC_PEERS={base.address} ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"
    assert f"export {variables}\n" in log.read_text()


@pytest.mark.soak
def test_processes_of_two_computers_use_one_server(
    computers: list[Computer], write_system: Callable[..., Path]
) -> None:
    robot, base = computers
    path = write_system(f"{{kind: server, address: {robot.address}, start: true}}", HOSTS)
    with run(base, path, "--process", "vision") as of_base, run(robot, path) as log:
        for text in ("2 of 2 nodes active", "picture"):
            wait_until(lambda text=text: text in log.read_text(), text)
        # On each computer, commands know the server from the process that runs there.
        assert "/robot: running, 2 of 2 nodes active" in base.check(*COMPOSE, "ps", "robot")
        assert "data: picture" in base.check(*COMPOSE, "topic", "echo", "/image", "--once")
        with observe(base, "/image") as other:
            other.wait_until_ready()
            assert other.ask() == (0, ["observer"])
        assert "discovery server" not in of_base.read_text()


@pytest.fixture(scope="module")
def plain_computers() -> Iterator[list[Computer]]:
    with network(["robot", "base"]) as made:
        yield made


def test_ros_nodes_discover_each_other_by_multicast(plain_computers: list[Computer]) -> None:
    robot, base = plain_computers
    talker = robot.start(
        sys.executable, str(PROGRAMS / "hand_written_talker.py"), stdout=subprocess.PIPE
    )
    assert talker.stdout is not None
    assert "ready\n" in talker.stdout
    command = (sys.executable, "-m", "composer", "topic", "echo", "/lab/text", "--once")
    wait_until(lambda: "xxx" in base.run(*command).stdout, "the topic is not discovered")
    # Shared memory would be a way around the network.
    assert "fastrtps_port" in robot.check("ls", "/dev/shm")
    assert "fastrtps_port" not in base.check("ls", "/dev/shm")
    robot.kill_all()
    talker.wait(PATIENCE_S)
    assert not robot.processes("hand_written_talker")


def test_a_link_can_be_cut_and_restored(plain_computers: list[Computer]) -> None:
    robot, base = plain_computers
    server = "import socket; s = socket.create_server(('', 5000)); print('ready', flush=True); "
    listening = robot.start(
        *(sys.executable, "-I", "-c", server + "[s.accept() for _ in range(9)]"),
        stdout=subprocess.PIPE,
    )
    assert listening.stdout is not None
    assert listening.stdout.readline() == "ready\n"
    client = f"import socket; socket.create_connection(('{robot.address}', 5000), timeout=0.5)"

    def reaches() -> bool:
        return base.run(sys.executable, "-I", "-c", client).returncode == 0

    assert reaches()
    robot.cut()
    assert not reaches()
    robot.join()
    wait_until(reaches, "the link is not restored")
    robot.kill_all()
    listening.wait(PATIENCE_S)
