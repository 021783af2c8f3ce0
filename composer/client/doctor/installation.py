"""What is installed and set on this computer: versions, variables, interfaces."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterable, Iterator, Mapping
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from composer import version
from composer.client.doctor import CheckResult, error, note, ok, warning
from composer.interfaces import Interfaces
from composer.model.interface_packages import how_to_build
from composer.runtime.middleware.environment import refusals

#: Areas of the checks.
_VERSIONS = "versions"
_ENVIRONMENT = "environment"
_INTERFACES = "interfaces"

#: Jazzy's rclpy, see https://github.com/ros2/rclpy/tree/jazzy.
_RCLPY_MAJOR = "7"
_FROM_PYPI = 'pip install "ros2-composer[ros]"'
_SOURCED = "source /opt/ros/jazzy/setup.bash"
_ROS_DISTRIBUTION = "jazzy"
#: The ports of other domains overlap with the ephemeral ports of Linux, from 32768 on.
#: See https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Domain-ID.html
_SAFE_DOMAIN_IDS = (range(102), range(215, 233))
_PROFILE_VARIABLES = ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")


def check_versions() -> Iterator[CheckResult]:
    """Check the versions of ros2-composer, Python and rclpy."""
    system = f"{platform.system()} {platform.machine()}"
    yield ok(_VERSIONS, f"ros2-composer {version()}, Python {platform.python_version()}, {system}")
    yield check_rclpy(has_rclpy=find_spec("rclpy") is not None, installed=_version_of("rclpy"))


def check_rclpy(*, has_rclpy: bool, installed: str | None) -> CheckResult:
    """Check rclpy in this Python; ``installed`` is its version if known."""
    if not has_rclpy:
        return error(
            _VERSIONS,
            f"rclpy is not installed in this Python ({sys.executable}): systems can be validated"
            " and drawn, but not run",
            f"{_FROM_PYPI}   or: {_SOURCED}",
        )
    if installed is None:
        return ok(_VERSIONS, "rclpy is installed; its version is unknown")
    if installed.split(".")[0] != _RCLPY_MAJOR:
        return warning(
            _VERSIONS,
            f"rclpy is {installed}; ros2-composer supports {_RCLPY_MAJOR}.x (Jazzy)",
            f"{_FROM_PYPI}   or: {_SOURCED}",
        )
    return ok(_VERSIONS, f"rclpy {installed}")


def _version_of(distribution: str) -> str | None:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def check_environment(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    """Check the environment variables of ROS."""
    refused = [error(_ENVIRONMENT, str(refusal), refusal.hint) for refusal in refusals(environment)]
    yield from refused
    if not refused:
        domain = environment.get("ROS_DOMAIN_ID") or "0"
        yield ok(
            _ENVIRONMENT, f"ROS_DOMAIN_ID {domain}, discovery range {discovery_range(environment)}"
        )
        yield from _domain(environment)
        yield from _discovery_variables(environment)
    yield from _distribution(environment)
    yield from _files(environment)


def discovery_range(environment: Mapping[str, str]) -> str:
    """Return the discovery range; the default is SUBNET."""
    chosen = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE")
    return "SUBNET" if chosen in (None, "", "SYSTEM_DEFAULT") else chosen


def _distribution(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    sourced = environment.get("ROS_DISTRO")
    if sourced and sourced != _ROS_DISTRIBUTION:
        yield warning(
            _ENVIRONMENT,
            f"ROS_DISTRO is '{sourced}'; ros2-composer supports {_ROS_DISTRIBUTION}",
            f"open a new terminal and source only /opt/ros/{_ROS_DISTRIBUTION}/setup.bash",
        )


def _domain(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    domain = int(environment.get("ROS_DOMAIN_ID") or 0)
    if not any(domain in safe for safe in _SAFE_DOMAIN_IDS):
        yield warning(
            _ENVIRONMENT,
            f"ROS_DOMAIN_ID is {domain}: its ports may be in use by other programs",
            "use a number from 0 to 101",
        )


def _discovery_variables(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    reach = discovery_range(environment)
    if reach == "OFF":
        yield warning(
            _ENVIRONMENT,
            "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: no other process is discovered",
            "unset it, or set it to LOCALHOST or SUBNET",
        )
    elif environment.get("ROS_STATIC_PEERS"):
        yield ok(_ENVIRONMENT, f"ROS_STATIC_PEERS {environment['ROS_STATIC_PEERS']}")
    elif reach == "LOCALHOST":
        yield note(
            _ENVIRONMENT,
            "ROS_AUTOMATIC_DISCOVERY_RANGE is LOCALHOST: other computers are not discovered",
            "unset it, or set it to SUBNET, if the system spans several computers",
        )
    if environment.get("ROS_LOCALHOST_ONLY") == "1":
        yield warning(
            _ENVIRONMENT,
            "ROS_LOCALHOST_ONLY is deprecated and overrides ROS_AUTOMATIC_DISCOVERY_RANGE",
            "unset it and set ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST",
        )
    is_super_client = environment.get("ROS_SUPER_CLIENT", "").lower() in ("true", "1")
    if environment.get("ROS_DISCOVERY_SERVER") and not is_super_client:
        yield note(
            _ENVIRONMENT,
            f"ROS_DISCOVERY_SERVER is {environment['ROS_DISCOVERY_SERVER']}: nodes are"
            " discovered only through that server",
            "set ROS_SUPER_CLIENT=TRUE to see the whole graph, or unset both",
        )


def _files(environment: Mapping[str, str]) -> Iterator[CheckResult]:
    for name in _PROFILE_VARIABLES:
        path = environment.get(name)
        if path and not Path(path).is_file():
            yield error(
                _ENVIRONMENT, f"{name} is '{path}', which is not a file", "correct or unset it"
            )
    for prefix in environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if prefix and not Path(prefix).is_dir():
            yield warning(
                _ENVIRONMENT,
                f"AMENT_PREFIX_PATH has '{prefix}', which is not a folder",
                "open a new terminal and source only existing workspaces",
            )
    keystore = environment.get("ROS_SECURITY_KEYSTORE")
    secure = environment.get("ROS_SECURITY_ENABLE") == "true"
    if secure and keystore and not Path(keystore).is_dir():
        yield error(
            _ENVIRONMENT,
            f"ROS_SECURITY_KEYSTORE is '{keystore}', which is not a folder",
            "create one with 'ros2 security create_keystore', or correct the path",
        )


def check_interfaces(
    packages: Iterable[str], sources: Interfaces, built: Interfaces
) -> Iterator[CheckResult]:
    """Check that ``packages`` are built from the current definitions.

    ``sources`` has the definitions of the project, ``built`` the installed ones.
    """
    required = sorted(packages)
    missing = [package for package in required if find_spec(package) is None]
    for package in missing:
        yield error(
            _INTERFACES,
            f"interface package '{package}' is not built: nodes that use it cannot start",
            how_to_build(package, sources.source_folder(package)),
        )
    stale = {
        package: names
        for package in required
        if package not in missing and (names := _changed(package, sources, built))
    }
    for package, names in stale.items():
        yield error(
            _INTERFACES,
            f"interface package '{package}' was built from different definitions of"
            f" {', '.join(names)}",
            f"{how_to_build(package, sources.source_folder(package))}, then restart all processes",
        )
    if required and not missing and not stale:
        yield ok(_INTERFACES, f"built: {', '.join(required)}")


def _changed(package: str, sources: Interfaces, built: Interfaces) -> list[str]:
    return [
        name
        for name in sources.names()
        if name.startswith(f"{package}/") and sources.find(name) != built.find(name)
    ]
