from __future__ import annotations

import fcntl
import socket
from dataclasses import replace
from pathlib import Path

import pytest

from composer.client.doctor import CheckResult, Level
from composer.client.doctor.installation import (
    check_environment,
    check_interfaces,
    check_rclpy,
    discovery_range,
)
from composer.client.doctor.network import check_declared_discovery, check_network
from composer.interfaces import Interfaces
from composer.model import Discovery, DiscoveryKind
from tests.unit.support.hosts import SPAN, located


def problems(results: list[CheckResult]) -> list[tuple[str, str]]:
    return [(item.level.value, item.message) for item in results if item.level is not Level.OK]


@pytest.mark.parametrize(
    ("environment", "level", "message"),
    [
        ({"ROS_DOMAIN_ID": "150"}, "warning", "its ports may be in use by other programs"),
        ({"ROS_DISTRO": "humble"}, "warning", "supports jazzy"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "warning", "no other process is discovered"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, "note", "other computers are not"),
        ({"ROS_LOCALHOST_ONLY": "1"}, "warning", "deprecated"),
        ({"ROS_DISCOVERY_SERVER": "10.0.0.1:11811"}, "note", "10.0.0.1:11811"),
        ({"FASTDDS_DEFAULT_PROFILES_FILE": "/gone.xml"}, "error", "which is not a file"),
        ({"AMENT_PREFIX_PATH": "/gone/install"}, "warning", "'/gone/install'"),
        ({"ROS_SECURITY_ENABLE": "true"}, "error", "ROS_SECURITY_KEYSTORE is not set"),
    ],
)
def test_problematic_variables_are_reported(
    environment: dict[str, str], level: str, message: str
) -> None:
    ((found_level, found),) = problems(list(check_environment(environment)))
    assert found_level == level
    assert message in found


@pytest.mark.parametrize("domain_id", ["", "0", "101", "215", "232"])
def test_a_valid_environment_is_ok(domain_id: str) -> None:
    (result,) = check_environment({"ROS_DOMAIN_ID": domain_id})
    assert result.level is Level.OK
    assert f"ROS_DOMAIN_ID {domain_id or '0'}, discovery range SUBNET" in result.message
    wrong = {"ROS_DOMAIN_ID": "-1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "HERE"}
    assert [level for level, _ in problems(list(check_environment(wrong)))] == ["error"] * 2
    assert discovery_range({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}) == "SUBNET"


def device(folder: Path, name: str, flags: int) -> None:
    (folder / name).mkdir()
    (folder / name / "flags").write_text(f"{flags:#x}\n")


def test_usable_interfaces_are_up_and_support_multicast(tmp_path: Path) -> None:
    device(tmp_path, "lo", 0x1009)
    device(tmp_path, "down", 0x1002)
    device(tmp_path, "tunnel", 0x91)
    found = list(check_network("SUBNET", devices=tmp_path, shared_memory=None))
    assert "no network interface is up" in found[0].message
    assert list(check_network("LOCALHOST", devices=tmp_path, shared_memory=None)) == []
    device(tmp_path, "eth0", 0x1003)
    found = list(check_network("SUBNET", devices=tmp_path, shared_memory=None))
    assert found[0].message == "interfaces with multicast: eth0"


def test_unlocked_segments_are_leftovers(tmp_path: Path) -> None:
    for name in ("fastrtps_dead_el", "fastrtps_alive_el", "other"):
        (tmp_path / name).write_bytes(b"")
    with (tmp_path / "fastrtps_alive_el").open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        ((level, message),) = problems(list(check_network("OFF", shared_memory=tmp_path)))
    assert level == "note"
    assert message.startswith("1 shared memory segment of")


def test_the_version_of_rclpy_is_checked() -> None:
    assert check_rclpy(has_rclpy=True, installed="7.1.6").level is Level.OK
    assert check_rclpy(has_rclpy=True, installed=None).level is Level.OK
    other = check_rclpy(has_rclpy=True, installed="3.3.11")
    assert (other.level, other.remedy is None) == (Level.WARNING, False)
    missing = check_rclpy(has_rclpy=False, installed=None)
    assert missing.level is Level.ERROR
    assert "ros2-composer[ros]" in (missing.remedy or "")


def interface_package(folder: Path, name: str, field: str) -> Interfaces:
    """Write a package with one message, and return its definitions."""
    (folder / name / "msg").mkdir(parents=True)
    (folder / name / "package.xml").write_text(f"<package><name>{name}</name></package>")
    (folder / name / "msg" / "Grip.msg").write_text(f"{field}\n")
    return Interfaces.load([folder])


def test_interface_packages_that_are_not_built_are_reported(tmp_path: Path) -> None:
    sources = interface_package(tmp_path, "arm_interfaces", "float64 force")
    (result,) = check_interfaces(["arm_interfaces"], sources, Interfaces.load())
    assert (result.level, result.area) == (Level.ERROR, "interfaces")
    assert "'arm_interfaces' is not built" in result.message
    assert (result.remedy or "").startswith("compose interface build arm_interfaces ")
    package = tmp_path / "arm_interfaces"
    (package / "pyproject.toml").touch()
    (result,) = check_interfaces(["arm_interfaces"], sources, Interfaces.load())
    assert (result.remedy or "").startswith(f"pip install {package} ")


def test_outdated_interface_packages_are_reported(tmp_path: Path) -> None:
    # A package of the standard library stands in for one that is built.
    new = interface_package(tmp_path / "new", "json", "float64 force")
    old = interface_package(tmp_path / "old", "json", "float32 force")
    (result,) = check_interfaces(["json"], new, old)
    assert result.message.endswith("built from different definitions of json/msg/Grip")
    (result,) = check_interfaces(["json"], new, new)
    assert result == CheckResult("interfaces", Level.OK, "built: json")


def declared(kind: str, **settings: object) -> Discovery:
    given = {
        name: (located(value),) if isinstance(value, str) else value
        for name, value in settings.items()
    }
    return Discovery(located(DiscoveryKind(kind)), SPAN, **given)  # type: ignore[arg-type]


@pytest.fixture
def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


@pytest.mark.parametrize(
    ("discovery", "level", "message"),
    [
        (declared("server", addresses="127.0.0.1"), "error", "does not run: nothing listens"),
        (declared("server", addresses="127.0.0.1", start=True), "ok", "'compose run' starts it"),
        (declared("server", addresses="robot.invalid"), "error", "name cannot be resolved"),
        (declared("peers", peers="robot.invalid"), "error", "name cannot be resolved"),
        (declared("peers", peers="127.0.0.1"), "ok", "there is a route to 127.0.0.1"),
        (declared("multicast", interfaces="lo"), "ok", "network interface lo exists"),
        (declared("multicast", interfaces="no0"), "error", "there is no network interface no0"),
    ],
)
def test_the_discovery_of_a_system_is_checked(
    discovery: Discovery, level: str, message: str, free_port: int
) -> None:
    (result,) = check_declared_discovery(replace(discovery, port=free_port), {})
    assert result.level.value == level
    assert message in result.message
    assert (result.remedy is None) is (level == "ok")


def test_a_port_in_use_is_taken_for_a_server_and_the_environment_takes_precedence() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        discovery = declared("server", addresses="127.0.0.1", port=listener.getsockname()[1])
        (result,) = check_declared_discovery(discovery, {})
    assert (result.level, "listens on that port" in result.message) == (Level.OK, True)
    environment = {"ROS_DISCOVERY_SERVER": "10.9.9.9:1"}
    (result,) = check_declared_discovery(declared("peers", peers="10.0.0.1"), environment)
    assert result.level is Level.WARNING
    assert "ROS_DISCOVERY_SERVER is set to '10.9.9.9:1'" in result.message
