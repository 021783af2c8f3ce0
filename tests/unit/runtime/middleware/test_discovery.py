"""The environment of a process: from the system, from running systems, or from the user."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from composer.base.source import Located
from composer.model import Discovery, DiscoveryKind
from composer.runtime.middleware.dds_xml import profile_with_segment, use_interfaces
from composer.runtime.middleware.environment import (
    active_variables,
    adopt_discovery,
    as_assignments,
    discovery_conflict,
    is_own_profile,
    use_discovery,
    use_discovery_profile,
)
from composer.runtime.process import StartRefused
from composer.runtime.process.computer import PortState, port_state
from composer.runtime.process.instance_lock import hold_instance_lock
from tests.unit.support.hosts import SPAN, located

PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"

SERVER = {"ROS_DISCOVERY_SERVER": "10.0.0.1:11811", "ROS_SUPER_CLIENT": "TRUE"}
PEERS = {"ROS_STATIC_PEERS": "10.0.0.1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


@pytest.fixture(autouse=True)
def runtime_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    return tmp_path


def texts(*values: str) -> tuple[Located[str], ...]:
    return tuple(map(located, values))


def discovery(kind: str, **settings: Any) -> Discovery:
    return Discovery(located(DiscoveryKind(kind)), SPAN, **settings)


SERVER_AT_10 = discovery("server", addresses=texts("10.0.0.1"))
PEERS_AT_10 = discovery("peers", peers=texts("10.0.0.1"))


@pytest.mark.parametrize(
    ("wanted", "before", "expected"),
    [
        (None, {}, {}),
        (SERVER_AT_10, {}, SERVER),
        (SERVER_AT_10, SERVER, SERVER),  # inherited from the coordinating process
        (PEERS_AT_10, {}, PEERS),
        (
            PEERS_AT_10,
            {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"},
            {"ROS_STATIC_PEERS": "10.0.0.1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"},
        ),
    ],
)
def test_what_is_not_set_is_set(
    wanted: Discovery | None, before: dict[str, str], expected: dict[str, str]
) -> None:
    environment = dict(before)
    use_discovery(wanted, environment)
    assert environment == expected
    assert active_variables(wanted, environment) == ({} if wanted is None else wanted.variables)


@pytest.mark.parametrize(
    ("wanted", "name"),
    [
        (SERVER_AT_10, "ROS_DISCOVERY_SERVER"),
        (SERVER_AT_10, "ROS_STATIC_PEERS"),
        (PEERS_AT_10, "ROS_STATIC_PEERS"),
        (discovery("multicast"), "ROS_DISCOVERY_SERVER"),
    ],
)
def test_the_environment_takes_precedence(wanted: Discovery, name: str) -> None:
    environment = {name: "10.9.9.9"}
    use_discovery(wanted, environment)
    assert environment == {name: "10.9.9.9"}
    conflict = discovery_conflict(wanted, environment)
    assert conflict == f"'discovery' of the system is not used: {name} is set to '10.9.9.9'"
    assert active_variables(wanted, environment) == {}


def test_assignments_can_be_pasted_into_a_shell() -> None:
    variables = {"ROS_DISCOVERY_SERVER": "a:1;b:2", "ROS_SUPER_CLIENT": "TRUE"}
    assert as_assignments(variables) == "ROS_DISCOVERY_SERVER='a:1;b:2' ROS_SUPER_CLIENT=TRUE"


def adopted(environment: dict[str, str]) -> tuple[str | None, dict[str, str]]:
    """Return the warning, and the environment of a command that has begun with this one."""
    return adopt_discovery(environment), environment


def test_a_command_adopts_the_discovery_of_running_systems_unless_they_differ() -> None:
    assert adopted({}) == (None, {})
    with (
        hold_instance_lock("/robot", {**SERVER, "LD_PRELOAD": "/evil.so"}),
        hold_instance_lock("/robot/acting", SERVER),
    ):
        assert adopted({}) == (None, SERVER), "and no other variable"
        by_user = {"ROS_STATIC_PEERS": "10.0.0.7"}
        assert adopted(dict(by_user)) == (None, by_user)
    assert adopted({}) == (None, {})
    with hold_instance_lock("/robot", SERVER), hold_instance_lock("/lab"):
        warning, environment = adopted({})
    assert environment == {}
    assert "/lab: multicast; /robot: ROS_DISCOVERY_SERVER=10.0.0.1:11811" in str(warning)


def settings_of(path: str) -> list[tuple[str, str]]:
    elements = ElementTree.parse(path).getroot().iter()
    return [(item.tag.rpartition("}")[2], (item.text or "").strip()) for item in elements]


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """An environment in which the default profile is selected."""
    selected: dict[str, str] = {}
    use_discovery_profile(selected, tmp_path)
    return selected


def test_interfaces_are_limited_by_a_profile_that_processes_share(
    environment: dict[str, str], tmp_path: Path
) -> None:
    for text in ("no-such-device", "203.0.113.77"):
        with pytest.raises(StartRefused, match=f"no network interface '{text}'") as refused:
            use_interfaces(discovery("multicast", interfaces=texts(text)), environment)
        assert "lo" in refused.value.hint
    wanted = discovery("multicast", interfaces=texts("lo", "127.0.0.1"))
    default = settings_of(environment[PROFILES])
    assert use_interfaces(wanted, environment) == []
    path = environment[PROFILES]
    assert path.startswith(f"{tmp_path}/ros2-composer-{os.geteuid()}/")
    limited = settings_of(path)
    assert {("interface", "lo"), ("address", "127.0.0.1"), ("type", "SHM")} <= set(limited)
    assert set(default) <= set(limited)
    # A process that was started by this one writes the same profile again.
    assert is_own_profile(environment)
    use_discovery_profile(environment, tmp_path)
    assert environment[PROFILES].endswith("/fast_dds.xml")
    assert use_interfaces(wanted, environment) == []
    assert environment[PROFILES] == path


def test_the_profile_for_large_messages_keeps_interfaces_and_has_peers(
    environment: dict[str, str], tmp_path: Path
) -> None:
    enlarged = tmp_path / "enlarged.xml"
    enlarged.write_bytes(profile_with_segment(environment[PROFILES], ["10.0.0.7", "jetson"]))
    addresses = [text for name, text in settings_of(str(enlarged)) if name == "address"]
    assert addresses == ["127.0.0.1", "10.0.0.7", "jetson"]
    use_interfaces(discovery("multicast", interfaces=texts("lo")), environment)
    enlarged.write_bytes(profile_with_segment(environment[PROFILES], None))
    settings = settings_of(str(enlarged))
    assert ("interface", "lo") in settings
    assert [name for name, _ in settings].count("transport_descriptor") == 2


@pytest.mark.parametrize(
    "configured",
    [
        {PROFILES: "mine.xml"},
        {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
    ],
)
def test_interfaces_give_way_to_the_environment(configured: dict[str, str], tmp_path: Path) -> None:
    environment = dict(configured)
    use_discovery_profile(environment, tmp_path)
    before = dict(environment)
    (warning,) = use_interfaces(discovery("multicast", interfaces=texts("lo")), environment)
    assert "'interfaces' of the system are not used" in warning
    assert environment == before


def test_the_state_of_a_port() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        address, port = listener.getsockname()
        assert port_state(address, port) is PortState.IN_USE
    assert port_state(address, port) is PortState.FREE
