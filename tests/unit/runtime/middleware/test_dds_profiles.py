"""A Fast DDS profile is selected or extended only if the user has not configured Fast DDS."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from composer.runtime.middleware import dds_xml
from composer.runtime.middleware.dds_xml import announce_less_often, segment_for_large_messages
from composer.runtime.middleware.environment import (
    use_command_profile,
    use_discovery_profile,
    use_large_system_profile,
)
from composer.runtime.middleware.local_resources import LARGE_SEGMENT_BYTES, MIN_FREE_BYTES

TAG = "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
FAST_DDS = "rmw_fastrtps_cpp"
LOCALHOST = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


@pytest.fixture(autouse=True)
def _enough_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dds_xml, "free_bytes", lambda: MIN_FREE_BYTES)


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """An environment in which the default profile is selected."""
    selected: dict[str, str] = {}
    use_discovery_profile(selected, tmp_path)
    return selected


def settings(environment: dict[str, str]) -> set[tuple[str, ...]]:
    """Return the values of the profile with their paths."""

    def walk(element: ElementTree.Element, path: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
        here = (*path, element.tag.removeprefix(TAG))
        if not len(element):
            yield (*here, (element.text or "").strip())
        for child in element:
            yield from walk(child, here)

    root = ElementTree.parse(environment[PROFILES]).getroot()
    assert root.tag == f"{TAG}dds"
    return set(walk(root, ()))


def values(environment: dict[str, str]) -> set[tuple[str, ...]]:
    """Return the names of the settings in the profile, with their values."""
    return {setting[-2:] for setting in settings(environment)}


def use_segment(environment: dict[str, str]) -> None:
    with segment_for_large_messages(environment, FAST_DDS, pytest.fail):
        within = dict(environment)
    environment.clear()
    environment.update(within)


EVERY_CHANGE = (use_command_profile, use_segment, use_large_system_profile, announce_less_often)


@pytest.mark.parametrize(
    ("configured", "changes"),
    [
        ({PROFILES: "mine.xml"}, EVERY_CHANGE),
        ({"FASTDDS_DEFAULT_PROFILES_FILE": "mine.xml"}, EVERY_CHANGE),
        ({"ROS_DISCOVERY_SERVER": "127.0.0.1:11811"}, EVERY_CHANGE),
        ({"FASTDDS_BUILTIN_TRANSPORTS": "LARGE_DATA"}, (use_command_profile, use_segment)),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, (use_segment,)),
        ({**LOCALHOST, "ROS_STATIC_PEERS": "10.0.0.7"}, (use_command_profile,)),
        ({**LOCALHOST, "ROS_LOCALHOST_ONLY": "1"}, (use_command_profile, use_segment)),
    ],
)
def test_the_configuration_of_the_user_is_kept(
    configured: dict[str, str],
    changes: tuple[Callable[[dict[str, str]], None], ...],
    tmp_path: Path,
) -> None:
    environment = dict(configured)
    use_discovery_profile(environment, tmp_path)
    if changes is EVERY_CHANGE:
        assert environment == configured
    before = dict(environment)
    for change in changes:
        change(environment)
        assert environment == before


def test_a_profile_in_the_current_folder_is_kept(tmp_path: Path) -> None:
    profile = tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml"
    profile.touch()
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
    assert Path(environment[PROFILES]).name == "fast_dds.xml"


def test_the_profile_for_large_systems_has_the_settings_of_writers_only(
    environment: dict[str, str],
) -> None:
    everything = settings(environment)
    use_large_system_profile(environment)
    left = settings(environment)
    assert left == {setting for setting in everything if "data_writer" in setting}
    assert left


def test_a_dashboard_announces_itself_less_often(
    environment: dict[str, str], tmp_path: Path
) -> None:
    everything = settings(environment)
    announce_less_often(environment)
    missing = everything - settings(environment)
    assert missing
    assert all("leaseAnnouncement" in setting for setting in missing)
    selected = dict(environment)
    use_discovery_profile(environment, tmp_path)  # it joins the ROS graph for another browser
    announce_less_often(environment)
    assert environment == selected


@pytest.mark.parametrize("discovery_range", ["", "SUBNET", "SYSTEM_DEFAULT"])
def test_a_command_uses_udp_only(discovery_range: str, tmp_path: Path) -> None:
    environment = {"ROS_AUTOMATIC_DISCOVERY_RANGE": discovery_range} if discovery_range else {}
    use_discovery_profile(environment, tmp_path)
    before, default = dict(environment), settings(environment)
    use_command_profile(environment)
    assert default
    assert default < settings(environment)
    assert environment.pop(PROFILES) != before.pop(PROFILES)
    assert environment == before | {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}


def test_on_localhost_the_profile_replaces_the_discovery_range(environment: dict[str, str]) -> None:
    on_localhost = environment | LOCALHOST
    use_command_profile(environment)
    use_command_profile(on_localhost)
    assert on_localhost["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SYSTEM_DEFAULT"
    assert settings(environment) < settings(on_localhost)
    assert ("address", "127.0.0.1") in values(on_localhost)


@pytest.mark.parametrize("large_system", [False, True])
@pytest.mark.parametrize("discovery_range", ["", "SUBNET", "LOCALHOST"])
def test_large_messages_extend_the_profile(
    discovery_range: str, large_system: bool, tmp_path: Path
) -> None:
    environment = {"ROS_AUTOMATIC_DISCOVERY_RANGE": discovery_range}
    use_discovery_profile(environment, tmp_path)
    if large_system:
        use_large_system_profile(environment)
    before, default = dict(environment), values(environment)
    with segment_for_large_messages(environment, FAST_DDS, pytest.fail):
        extended = values(environment)
        is_local = environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SYSTEM_DEFAULT"
        file = Path(environment[PROFILES])
    assert environment == before
    assert not file.exists()
    assert default < extended
    assert ("segment_size", str(LARGE_SEGMENT_BYTES)) in extended
    assert is_local is (("address", "127.0.0.1") in extended) is (discovery_range == "LOCALHOST")


def test_without_fast_dds_or_memory_large_messages_change_nothing(
    environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    environment |= LOCALHOST
    before = dict(environment)
    with segment_for_large_messages(environment, "rmw_cyclonedds_cpp", pytest.fail):
        assert environment == before
    monkeypatch.setattr(dds_xml, "free_bytes", lambda: MIN_FREE_BYTES - 1)
    warnings: list[str] = []
    with segment_for_large_messages(environment, FAST_DDS, warnings.append):
        assert environment == before
    assert warnings == [
        "only 31 MB are free in /dev/shm: large messages to other processes may be late or lost;"
        " see 'compose doctor'"
    ]
