"""The discovery of a system: environment variables, and what is wrong with addresses."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.loading import load
from composer.model import Discovery, member_system
from composer.model.hosts import interface_problem, is_loopback, peer_problem, server_problem

NODES = "nodes: {arm: {process: acting, on_activate: {log: on}}}\nprocesses: {acting: {}}\n"


def discovery_of(text: str, folder: Path) -> Discovery:
    path = folder / "robot.yaml"
    path.write_text(f"system: robot\ndiscovery: {text}\n{NODES}", encoding="utf-8")
    result = load(path)
    assert result.system is not None
    assert result.diagnostics == []
    assert result.system.discovery is not None
    return result.system.discovery


@pytest.mark.parametrize(
    ("text", "variables"),
    [
        ("{kind: multicast, interfaces: [eth0]}", {}),
        (
            "{kind: server, address: 10.0.0.1}",
            {"ROS_DISCOVERY_SERVER": "10.0.0.1:11811", "ROS_SUPER_CLIENT": "TRUE"},
        ),
        (
            '{kind: server, address: [10.0.0.1, "jetson:7"], port: 4000}',
            {"ROS_DISCOVERY_SERVER": "10.0.0.1:4000;jetson:7", "ROS_SUPER_CLIENT": "TRUE"},
        ),
        (
            "{kind: peers, peers: [10.0.0.1, jetson.local]}",
            {
                "ROS_STATIC_PEERS": "10.0.0.1;jetson.local",
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            },
        ),
    ],
)
def test_a_discovery_is_expressed_by_variables_of_ros(
    text: str, variables: dict[str, str], tmp_path: Path
) -> None:
    assert discovery_of(text, tmp_path).variables == variables


def test_variables_of_the_file_are_inserted(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    discovery = 'arguments: {at: 10.0.0.1, port: 5}\ndiscovery: {kind: server, address: "${at}"'
    path.write_text(f"system: robot\n{discovery}, port: '${{port}}'}}\n{NODES}", encoding="utf-8")
    system = load(path).system
    assert system is not None
    assert system.discovery is not None
    assert system.discovery.servers == (("10.0.0.1", 5),)


def test_only_the_coordinating_process_starts_the_server(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    discovery = "discovery: {kind: server, address: localhost, start: true}"
    path.write_text(f"system: robot\n{discovery}\n{NODES}", encoding="utf-8")
    system = load(path).system
    assert system is not None
    member = member_system(system, "acting")
    assert system.discovery is not None
    assert member.discovery is not None
    assert (system.discovery.start, member.discovery.start) == (True, False)
    assert member.discovery.variables == system.discovery.variables


@pytest.mark.parametrize(
    ("address", "problem"),
    [
        ("10.0.0.1", None),
        ("10.0.0.1:11811", None),
        ("jetson-1.local:65535", None),
        ("robot_1", None),
        ("10.0.0.1:", "has no valid port"),
        ("10.0.0.1:0", "has no valid port"),
        ("10.0.0.1:65536", "has no valid port"),
        ("10.0.0.1:\u0661", "has no valid port"),
        ("10.0.0:11811", "is not an IPv4 address"),
        ("10.0..1", "is not an IPv4 address"),
        ("10.0.0.256", "is not an IPv4 address"),
        ("0.0.0.0", "is not the address of a computer"),
        ("239.255.0.1", "is not the address of a computer"),
        ("::1", "is an IPv6 address"),
        ("[::1]:11811", "is an IPv6 address"),
        ("", "is neither an IPv4 address nor a host name"),
        (":11811", "is neither an IPv4 address nor a host name"),
        ("my robot", "is neither an IPv4 address nor a host name"),
        ("robot;10.0.0.1", "is neither an IPv4 address nor a host name"),
        ("-robot", "is neither an IPv4 address nor a host name"),
    ],
)
def test_addresses_of_servers(address: str, problem: str | None) -> None:
    found = server_problem(address)
    assert (found or "").startswith(problem or "")
    assert (found is None) is (problem is None)


def test_peers_have_no_port_and_interfaces_no_path() -> None:
    assert peer_problem("10.0.0.1:7400") == "has a port, which peers do not have"
    assert interface_problem("eth0") is None
    assert interface_problem("10.0.0.1") is None
    assert interface_problem("10.0.0") is not None
    assert interface_problem("a/b") is not None
    assert interface_problem("sixteen_letters_") is not None


@given(st.text(max_size=300))
def test_what_is_valid_is_one_entry_of_a_list(text: str) -> None:
    for find_problem in (server_problem, peer_problem, interface_problem):
        if find_problem(text) is None:
            assert text
            assert not set(text) & set(";'\"<&\n ")


def test_loopback_addresses() -> None:
    assert all(map(is_loopback, ("localhost", "127.0.0.1", "127.1.2.3")))
    assert not any(map(is_loopback, ("10.0.0.1", "jetson", "127.example.org")))
