"""A Fast DDS profile is selected only if the user has not configured Fast DDS."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from composer.runtime.middleware.dds_profiles import (
    use_command_profile,
    use_discovery_profile,
    use_large_system_profile,
)
from composer.runtime.middleware.dds_xml import announce_less_often


def test_the_default_profile_is_valid_xml(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    root = ElementTree.parse(environment["FASTRTPS_DEFAULT_PROFILES_FILE"]).getroot()
    assert root.tag == "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}dds"


@pytest.mark.parametrize(
    "configured",
    [
        {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"},
        {"FASTDDS_DEFAULT_PROFILES_FILE": "mine.xml"},
        {"ROS_DISCOVERY_SERVER": "127.0.0.1:11811"},
    ],
)
def test_the_configuration_of_the_user_is_kept(configured: dict[str, str], tmp_path: Path) -> None:
    environment = dict(configured)
    use_discovery_profile(environment, tmp_path)
    assert environment == configured


def test_a_profile_in_the_current_folder_is_kept(tmp_path: Path) -> None:
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").touch()
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    assert environment == {}


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_profile_of_another_user_in_the_current_folder_is_skipped(tmp_path: Path) -> None:
    profile = tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml"
    profile.touch()
    os.chown(profile, 65534, 65534)
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    assert environment["SKIP_DEFAULT_XML_FILE"] == "1"
    assert Path(environment["FASTRTPS_DEFAULT_PROFILES_FILE"]).name == "fast_dds.xml"


def test_the_profile_for_large_systems_has_the_settings_of_writers_only(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    everything = _settings(environment)
    use_large_system_profile(environment)
    left = _settings(environment)
    assert left == {setting for setting in everything if "data_writer" in setting}
    assert left
    configured = {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}
    use_large_system_profile(configured)
    assert configured == {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}


def test_a_dashboard_announces_itself_less_often(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    everything = _settings(environment)
    announce_less_often(environment)
    missing = everything - _settings(environment)
    assert missing
    assert all("leaseAnnouncement" in setting for setting in missing)
    selected = dict(environment)
    use_discovery_profile(environment, tmp_path)  # it joins the ROS graph for another browser
    announce_less_often(environment)
    assert environment == selected
    configured = {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}
    announce_less_often(configured)
    assert configured == {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}


@pytest.mark.parametrize("discovery_range", [None, "SUBNET", "SYSTEM_DEFAULT"])
def test_a_command_uses_udp_only(discovery_range: str | None, tmp_path: Path) -> None:
    environment = (
        {} if discovery_range is None else {"ROS_AUTOMATIC_DISCOVERY_RANGE": discovery_range}
    )
    use_discovery_profile(environment, tmp_path)
    before = dict(environment)
    use_command_profile(environment)
    profile = environment.pop("FASTRTPS_DEFAULT_PROFILES_FILE")
    assert profile != before.pop("FASTRTPS_DEFAULT_PROFILES_FILE")
    assert environment == before | {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}


def test_on_localhost_the_profile_replaces_the_discovery_range(tmp_path: Path) -> None:
    environment = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    use_discovery_profile(environment, tmp_path)
    use_command_profile(environment)
    assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SYSTEM_DEFAULT"
    profile = ElementTree.parse(environment["FASTRTPS_DEFAULT_PROFILES_FILE"])
    texts = [text.strip() for text in profile.getroot().itertext() if text.strip()]
    assert "127.0.0.1" in texts


@pytest.mark.parametrize(
    "configured",
    [
        {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"},
        {"ROS_DISCOVERY_SERVER": "127.0.0.1:11811"},
        {"FASTDDS_BUILTIN_TRANSPORTS": "LARGE_DATA"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_STATIC_PEERS": "10.0.0.7"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_LOCALHOST_ONLY": "1"},
    ],
)
def test_a_command_keeps_the_configuration_of_the_user(
    configured: dict[str, str], tmp_path: Path
) -> None:
    environment = dict(configured)
    use_discovery_profile(environment, tmp_path)
    before = dict(environment)
    use_command_profile(environment)
    assert environment == before


def test_profiles_for_commands_extend_the_default_profile(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    default = _settings(environment)
    commands, commands_on_localhost = (
        _settings(_for_command(environment | {"ROS_AUTOMATIC_DISCOVERY_RANGE": value}))
        for value in ("SUBNET", "LOCALHOST")
    )
    assert default
    assert default < commands < commands_on_localhost


def _for_command(environment: dict[str, str]) -> dict[str, str]:
    use_command_profile(environment)
    return environment


def _settings(environment: dict[str, str]) -> set[tuple[str, ...]]:
    """Return the values of the profile with their paths."""
    profile = environment["FASTRTPS_DEFAULT_PROFILES_FILE"]

    def walk(element: ElementTree.Element, path: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
        here = (*path, element.tag.rpartition("}")[2])
        if not len(element):
            yield (*here, (element.text or "").strip())
        for child in element:
            yield from walk(child, here)

    return set(walk(ElementTree.parse(profile).getroot(), ()))
