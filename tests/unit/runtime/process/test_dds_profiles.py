"""The profile for Fast DDS is chosen only where the user has not chosen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from composer.runtime.process.dds_profiles import (
    use_command_profile,
    use_discovery_profile,
    use_large_system_profile,
)


def test_a_profile_is_chosen_that_is_there_and_is_xml(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    root = ElementTree.parse(environment["FASTRTPS_DEFAULT_PROFILES_FILE"]).getroot()
    assert root.tag == "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}dds"


@pytest.mark.parametrize(
    "chosen",
    [
        {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"},
        {"FASTDDS_DEFAULT_PROFILES_FILE": "mine.xml"},
        {"ROS_DISCOVERY_SERVER": "127.0.0.1:11811"},
    ],
)
def test_what_the_user_chose_is_left_alone(chosen: dict[str, str], tmp_path: Path) -> None:
    environment = dict(chosen)
    use_discovery_profile(environment, tmp_path)
    assert environment == chosen


def test_a_file_that_fast_dds_finds_by_itself_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").touch()
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    assert environment == {}


def test_what_concerns_discovery_is_taken_back_of_our_profile_alone(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    everything = _settings(environment)
    use_large_system_profile(environment)
    left = _settings(environment)
    assert left == {setting for setting in everything if "data_writer" in setting}
    assert left
    chosen = {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}
    use_large_system_profile(chosen)
    assert chosen == {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}


@pytest.mark.parametrize("reach", [None, "SUBNET", "SYSTEM_DEFAULT"])
def test_a_command_uses_udp_alone(reach: str | None, tmp_path: Path) -> None:
    environment = {} if reach is None else {"ROS_AUTOMATIC_DISCOVERY_RANGE": reach}
    use_discovery_profile(environment, tmp_path)
    before = dict(environment)
    use_command_profile(environment)
    profile = environment.pop("FASTRTPS_DEFAULT_PROFILES_FILE")
    assert profile != before.pop("FASTRTPS_DEFAULT_PROFILES_FILE")
    assert environment == before | {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}


def test_on_this_computer_alone_the_profile_says_what_the_range_would(tmp_path: Path) -> None:
    environment = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    use_discovery_profile(environment, tmp_path)
    use_command_profile(environment)
    assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SYSTEM_DEFAULT"
    profile = ElementTree.parse(environment["FASTRTPS_DEFAULT_PROFILES_FILE"])
    texts = [text.strip() for text in profile.getroot().itertext() if text.strip()]
    assert "127.0.0.1" in texts


@pytest.mark.parametrize(
    "chosen",
    [
        {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"},
        {"ROS_DISCOVERY_SERVER": "127.0.0.1:11811"},
        {"FASTDDS_BUILTIN_TRANSPORTS": "LARGE_DATA"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_STATIC_PEERS": "10.0.0.7"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_LOCALHOST_ONLY": "1"},
    ],
)
def test_a_command_keeps_to_what_the_user_chose(chosen: dict[str, str], tmp_path: Path) -> None:
    environment = dict(chosen)
    use_discovery_profile(environment, tmp_path)
    before = dict(environment)
    use_command_profile(environment)
    assert environment == before


def test_each_profile_says_what_the_one_before_it_says_and_more(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    of_all = _settings(environment)
    of_commands, of_commands_here = (
        _settings(_suited(environment | {"ROS_AUTOMATIC_DISCOVERY_RANGE": reach}))
        for reach in ("SUBNET", "LOCALHOST")
    )
    assert of_all
    assert of_all < of_commands < of_commands_here


def _suited(environment: dict[str, str]) -> dict[str, str]:
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
