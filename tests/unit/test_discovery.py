"""The profile for Fast DDS is chosen only where the user has not chosen."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from composer.runtime.discovery import complete_discovery, leave_discovery_alone


def test_a_profile_is_chosen_that_is_there_and_is_xml(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    complete_discovery(environment, tmp_path)
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
    complete_discovery(environment, tmp_path)
    assert environment == chosen


def test_a_file_that_fast_dds_finds_by_itself_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").touch()
    environment: dict[str, str] = {}
    complete_discovery(environment, tmp_path)
    assert environment == {}


def test_the_profile_is_taken_back_and_no_other(tmp_path: Path) -> None:
    environment: dict[str, str] = {}
    complete_discovery(environment, tmp_path)
    leave_discovery_alone(environment)
    assert environment == {}
    chosen = {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}
    leave_discovery_alone(chosen)
    assert chosen == {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}
