"""The network of the tests: what its computers share and what they do not."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from tests.ros.network.namespaces import PATIENCE_S, Computer, network
from tests.ros.support.commands import PROGRAMS


@pytest.fixture(scope="module")
def computers() -> Iterator[list[Computer]]:
    with network(["robot", "base"]) as made:
        yield made


def test_ros_nodes_discover_each_other_by_multicast(computers: list[Computer]) -> None:
    robot, base = computers
    talker = robot.start(
        sys.executable, str(PROGRAMS / "hand_written_talker.py"), stdout=subprocess.PIPE
    )
    assert talker.stdout is not None
    assert "ready\n" in talker.stdout
    command = (sys.executable, "-m", "composer", "topic", "echo", "/lab/text", "--once")
    assert "xxx" in base.check(*command)
    # Shared memory would be a way around the network.
    assert "fastrtps_port" in robot.check("ls", "/dev/shm")
    assert "fastrtps_port" not in base.check("ls", "/dev/shm")
    robot.kill_all()
    talker.wait(PATIENCE_S)
    assert not robot.processes("hand_written_talker")


def test_a_link_can_be_cut_and_restored(computers: list[Computer]) -> None:
    robot, base = computers
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
    end_s = time.monotonic() + PATIENCE_S
    while not reaches():
        assert time.monotonic() < end_s
    robot.kill_all()
    listening.wait(PATIENCE_S)
