"""The processes of a system, the hosts that they are on, and how they discover each other."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.model import OnFailure, PrimaryState, System, member_system
from composer.model.hosts import (
    address_problem,
    domain_problem,
    interface_problem,
    is_loopback,
    key_file_problem,
    name_problem,
    peer_problem,
    server_problem,
    user_problem,
    workspace_problem,
)
from tests.unit.support.checking import valid_system


@pytest.mark.parametrize(
    ("text", "part"),
    [
        *((text, None) for text in ("~/robot", "/opt/robot", "/home/pilot/robot", "~/ws/robot")),
        *((text, "neither") for text in ("", ".", "robot", "~pilot/robot")),
        *((text, "root") for text in ("/", "//")),
        *((text, "home folder") for text in ("~", "~/", "~/.", "/home/pilot", "/home/pilot/")),
        ("/usr", "operating system"),
        ("/opt/../etc", ".."),
        ("~/a\nb", "control"),
    ],
)
def test_workspaces(text: str, part: str | None) -> None:
    problem = workspace_problem(text)
    assert problem is None if part is None else part in problem


PROBLEMS = {
    "name": name_problem,
    "address": address_problem,
    "user": user_problem,
    "file": key_file_problem,
}


BAD_WORDS = ("", "-oProxyCommand=x", "a b", "a\n", "me@there", "a'b")
BAD_WORDS += ("x/y", "..", "%n", "$(x)", "a;b")


@pytest.mark.parametrize(
    ("what", "valid", "invalid"),
    [
        (
            "name",
            ("jetson", "Arm-2", "7", "a" * 63),
            (*BAD_WORDS, "a.b", "a_b", "a-", "a" * 64, "müller"),
        ),
        (
            "address",
            ("robot", "10.0.0.5", "::1", "fe80::1%eth0", "jetson.local", "arm_1"),
            (*BAD_WORDS, "999.1.1.1", f"{'9' * 5000}.1.1.1", "fe80::1%a b", "a:b"),
        ),
        ("user", ("robot", "a.b", "_ros-2", "müller"), BAD_WORDS),
        (
            "file",
            ("~/.ssh/id", "keys/my %h key", "it's", "..id"),
            ('a"b', "a\nb", "a\\b", "${HOME}/id"),
        ),
    ],
)
def test_words(what: str, valid: tuple[str, ...], invalid: tuple[str, ...]) -> None:
    assert [text for text in valid if PROBLEMS[what](text) is not None] == []
    assert [text for text in invalid if PROBLEMS[what](text) is None] == []


def test_domains() -> None:
    for text in ("", "0", "7", "007", "101", "232", "0" * 5000):
        assert domain_problem(text) is None, text
    for text in ("233", "700", "-1", "1.5", " 7", "seven", "²", "9" * 5000):
        assert domain_problem(text) == "is not a number from 0 to 232", text


NODES = "nodes: {arm: {process: acting, on_activate: {log: on}}}\nprocesses: {acting: {}}\n"
SERVER = {"ROS_DISCOVERY_SERVER": "10.0.0.1:11811", "ROS_SUPER_CLIENT": "TRUE"}


@pytest.mark.parametrize(
    ("text", "variables"),
    [
        ("{kind: multicast, interfaces: [eth0]}", {}),
        ("{kind: server, address: 10.0.0.1}", SERVER),
        (
            '{kind: server, address: [10.0.0.1, "jetson:7"], port: 4000}',
            SERVER | {"ROS_DISCOVERY_SERVER": "10.0.0.1:4000;jetson:7"},
        ),
        # Only the coordinating process starts the server.
        ("{kind: server, address: 10.0.0.1, start: true}", SERVER),
        # Variables of the file are inserted.
        ("{kind: server, address: '${at}', port: '${port}'}", SERVER),
        (
            "{kind: peers, peers: [10.0.0.1, jetson.local]}",
            {
                "ROS_STATIC_PEERS": "10.0.0.1;jetson.local",
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            },
        ),
    ],
)
def test_variables_of_a_discovery(text: str, variables: dict[str, str], tmp_path: Path) -> None:
    arguments = "arguments: {at: 10.0.0.1, port: 11811}\n" if "${" in text else ""
    whole = f"system: robot\n{arguments}discovery: {text}\n{NODES}"
    system = valid_system(tmp_path, {"robot.yaml": whole})
    member = member_system(system, "acting")
    assert system.discovery.variables == member.discovery.variables == variables
    assert (system.discovery.start, member.discovery.start) == ("start: true" in text, False)


@pytest.mark.parametrize(
    ("problem", "addresses"),
    [
        (None, ("10.0.0.1", "10.0.0.1:11811", "jetson-1.local:65535", "robot_1")),
        ("has no valid port", ("10.0.0.1:", "10.0.0.1:0", "10.0.0.1:65536", "10.0.0.1:\u0661")),
        ("is not an IPv4 address", ("10.0.0:11811", "10.0..1", "10.0.0.256")),
        ("is not the address of a computer", ("0.0.0.0", "239.255.0.1")),
        ("is an IPv6 address", ("::1", "[::1]:11811")),
        (
            "is neither an IPv4 address nor a host name",
            ("", ":11811", "my robot", "robot;10.0.0.1", "-robot"),
        ),
    ],
)
def test_addresses_of_servers(problem: str | None, addresses: tuple[str, ...]) -> None:
    for address in addresses:
        found = server_problem(address)
        assert (found or "").startswith(problem or ""), address
        assert (found is None) is (problem is None), address


def test_peers_have_no_port_and_interfaces_no_path() -> None:
    assert peer_problem("10.0.0.1:7400") == "has a port, which peers do not have"
    names = ("eth0", "10.0.0.1", "10.0.0", "a/b", "sixteen_letters_")
    assert [name for name in names if interface_problem(name) is None] == ["eth0", "10.0.0.1"]


@given(st.text(max_size=300))
def test_what_is_valid_is_one_entry_of_a_list(text: str) -> None:
    for find_problem in (server_problem, peer_problem, interface_problem):
        if find_problem(text) is None:
            assert text
            assert not set(text) & set(";'\"<&\n ")


def test_loopback_addresses() -> None:
    assert all(map(is_loopback, ("localhost", "127.0.0.1", "127.1.2.3")))
    assert not any(map(is_loopback, ("10.0.0.1", "jetson", "127.example.org")))


TEXT = """
system: robot
namespace: lab
lifecycle: {on_failure: shutdown}
hosts: {jetson: {address: 10.0.0.5, user: pilot, workspace: ~/robot, setup: [env.sh]}}
processes:
  vision: {nodes: ["camera_*"], cpus: [1, 2], environment: {SIZE: 3}, memory_mb: 200, host: jetson}
  control: {}
nodes:
  camera_front: {on_activate: {log: on}}
  camera_rear: {on_activate: {log: on}, lifecycle: {depends_on: [arm], on_failure: restart}}
  arm: {process: control, on_activate: {log: on}}
  logger: {on_activate: {log: on}}
"""


@pytest.fixture
def system(tmp_path: Path) -> System:
    return valid_system(tmp_path, {"robot.yaml": TEXT})


def test_nodes_have_processes_by_name_pattern_and_key(system: System) -> None:
    processes = {node.name.value: node.process and node.process.value for node in system.nodes}
    assert processes == {
        "camera_front": "vision",
        "camera_rear": "vision",
        "arm": "control",
        "logger": None,
    }
    vision = system.processes[0]
    assert (vision.cpus, vision.memory_mb.value, vision.host.value) == ((1, 2), 200, "jetson")
    assert [(name.value, value) for name, value in vision.environment] == [("SIZE", "3")]
    assert system.hosts[0].login == "pilot@10.0.0.5"
    assert system.hosts[0].setup == ("env.sh",)


def test_a_process_takes_failed_nodes_down_and_knows_how_far_nodes_start(system: System) -> None:
    member = member_system(system, "vision", {"camera_front": PrimaryState.INACTIVE})
    assert member.name.value == "robot/vision"
    assert [node.full_name for node in member.nodes] == ["/lab/camera_front", "/lab/camera_rear"]
    for node in member.nodes:
        assert node.in_process
        assert not node.depends_on
        assert node.supervision.policy is OnFailure.ISOLATE
    front, rear = member.nodes
    assert front.autostart.value is PrimaryState.INACTIVE
    assert rear.autostart is None
