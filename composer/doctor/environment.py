"""The environment variables of ROS: invalid values, and values that limit discovery."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from composer.doctor.result import CheckResult, error, note, ok, warning
from composer.runtime.middleware.environment import refusals

AREA = "environment"
DISTRIBUTION = "jazzy"
#: The ports of other domains overlap with the ephemeral ports of Linux, from 32768 on.
#: See https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Domain-ID.html
_SAFE_DOMAIN_IDS = (range(102), range(215, 233))
_PROFILES = ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")


def check_environment(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    """Check the environment variables of ROS."""
    refused = [error(AREA, str(refusal), refusal.hint) for refusal in refusals(environment)]
    yield from refused
    if not refused:
        domain = environment.get("ROS_DOMAIN_ID") or "0"
        yield ok(AREA, f"ROS_DOMAIN_ID {domain}, discovery range {discovery_range(environment)}")
        yield from _domain(environment)
        yield from _discovery(environment)
    yield from _distribution(environment)
    yield from _files(environment)


def discovery_range(environment: Mapping[str, str]) -> str:
    """Return the discovery range; the default is SUBNET."""
    chosen = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE")
    return "SUBNET" if chosen in (None, "", "SYSTEM_DEFAULT") else chosen


def _distribution(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    sourced = environment.get("ROS_DISTRO")
    if sourced and sourced != DISTRIBUTION:
        yield warning(
            AREA,
            f"ROS_DISTRO is '{sourced}'; ros2-composer supports {DISTRIBUTION}",
            f"open a new terminal and source only /opt/ros/{DISTRIBUTION}/setup.bash",
        )


def _domain(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    domain = int(environment.get("ROS_DOMAIN_ID") or 0)
    if not any(domain in safe for safe in _SAFE_DOMAIN_IDS):
        yield warning(
            AREA,
            f"ROS_DOMAIN_ID is {domain}: its ports may be in use by other programs",
            "use a number from 0 to 101",
        )


def _discovery(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    reach = discovery_range(environment)
    if reach == "OFF":
        yield warning(
            AREA,
            "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: no other process is discovered",
            "unset it, or set it to LOCALHOST or SUBNET",
        )
    elif environment.get("ROS_STATIC_PEERS"):
        yield ok(AREA, f"ROS_STATIC_PEERS {environment['ROS_STATIC_PEERS']}")
    elif reach == "LOCALHOST":
        yield note(
            AREA,
            "ROS_AUTOMATIC_DISCOVERY_RANGE is LOCALHOST: other computers are not discovered",
            "unset it, or set it to SUBNET, if the system spans several computers",
        )
    if environment.get("ROS_LOCALHOST_ONLY") == "1":
        yield warning(
            AREA,
            "ROS_LOCALHOST_ONLY is deprecated and overrides ROS_AUTOMATIC_DISCOVERY_RANGE",
            "unset it and set ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST",
        )
    is_super_client = environment.get("ROS_SUPER_CLIENT", "").lower() in ("true", "1")
    if environment.get("ROS_DISCOVERY_SERVER") and not is_super_client:
        yield note(
            AREA,
            f"ROS_DISCOVERY_SERVER is {environment['ROS_DISCOVERY_SERVER']}: nodes are"
            " discovered only through that server",
            "set ROS_SUPER_CLIENT=TRUE to see the whole graph, or unset both",
        )


def _files(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    for name in _PROFILES:
        path = environment.get(name)
        if path and not Path(path).is_file():
            yield error(AREA, f"{name} is '{path}', which is not a file", "correct or unset it")
    for prefix in environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if prefix and not Path(prefix).is_dir():
            yield warning(
                AREA,
                f"AMENT_PREFIX_PATH has '{prefix}', which is not a folder",
                "open a new terminal and source only existing workspaces",
            )
    keystore = environment.get("ROS_SECURITY_KEYSTORE")
    secure = environment.get("ROS_SECURITY_ENABLE") == "true"
    if secure and keystore and not Path(keystore).is_dir():
        yield error(
            AREA,
            f"ROS_SECURITY_KEYSTORE is '{keystore}', which is not a folder",
            "create one with 'ros2 security create_keystore', or correct the path",
        )
