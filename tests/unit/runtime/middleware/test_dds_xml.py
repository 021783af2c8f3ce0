"""A large shared memory segment is selected unless the user has configured Fast DDS."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from composer.runtime.middleware import dds_xml
from composer.runtime.middleware.dds_profiles import (
    use_discovery_profile,
    use_large_system_profile,
)
from composer.runtime.middleware.dds_xml import segment_for_large_messages
from composer.runtime.middleware.shared_memory import LARGE_SEGMENT_BYTES, MIN_FREE_BYTES

TAG = "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}"
FAST_DDS = "rmw_fastrtps_cpp"


@pytest.fixture(autouse=True)
def _enough_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dds_xml, "free_bytes", lambda: MIN_FREE_BYTES)


@pytest.mark.parametrize("large_system", [False, True])
@pytest.mark.parametrize("discovery_range", ["", "SUBNET", "LOCALHOST"])
def test_the_profile_is_extended(discovery_range: str, large_system: bool, tmp_path: Path) -> None:
    environment = {"ROS_AUTOMATIC_DISCOVERY_RANGE": discovery_range}
    use_discovery_profile(environment, tmp_path)
    if large_system:
        use_large_system_profile(environment)
    before = dict(environment)
    default = _texts(environment)
    with segment_for_large_messages(environment, FAST_DDS, pytest.fail):
        extended = _texts(environment)
        is_local = environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SYSTEM_DEFAULT"
        file = Path(environment["FASTRTPS_DEFAULT_PROFILES_FILE"])
    assert environment == before
    assert not file.exists()
    assert default < extended
    assert ("segment_size", str(LARGE_SEGMENT_BYTES)) in extended
    assert is_local is (("address", "127.0.0.1") in extended) is (discovery_range == "LOCALHOST")


@pytest.mark.parametrize(
    "configured",
    [
        {"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"},
        {"FASTDDS_BUILTIN_TRANSPORTS": "DEFAULT"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_LOCALHOST_ONLY": "1"},
    ],
)
def test_the_configuration_of_the_user_is_kept(configured: dict[str, str], tmp_path: Path) -> None:
    environment = dict(configured)
    use_discovery_profile(environment, tmp_path)
    before = dict(environment)
    with segment_for_large_messages(environment, FAST_DDS, pytest.fail):
        assert environment == before


def test_other_middlewares_keep_their_environment(tmp_path: Path) -> None:
    environment = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    use_discovery_profile(environment, tmp_path)
    before = dict(environment)
    with segment_for_large_messages(environment, "rmw_cyclonedds_cpp", pytest.fail):
        assert environment == before


def test_too_little_memory_is_reported(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(dds_xml, "free_bytes", lambda: MIN_FREE_BYTES - 1)
    environment: dict[str, str] = {}
    use_discovery_profile(environment, tmp_path)
    before = dict(environment)
    warnings: list[str] = []
    with segment_for_large_messages(environment, FAST_DDS, warnings.append):
        assert environment == before
    assert warnings == [
        "only 31 MB are free in /dev/shm: large messages to other processes may be late or lost;"
        " see 'compose doctor'"
    ]


def _texts(environment: dict[str, str]) -> set[tuple[str, str]]:
    """Return the names and values of the settings in the profile."""
    root = ElementTree.parse(environment["FASTRTPS_DEFAULT_PROFILES_FILE"]).getroot()
    assert root.tag == f"{TAG}dds"
    return {
        (item.tag.removeprefix(TAG), (item.text or "").strip())
        for item in root.iter()
        if not len(item)
    }
