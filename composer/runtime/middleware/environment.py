"""Checks and completes the environment variables that ROS reads when it starts.

rclpy accepts a domain id of -1 and unknown discovery ranges without an error, and runs unsecured if
security is enabled but not available. Here, these are errors.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping, MutableMapping
from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import nearest
from composer.model.hosts import HIGHEST_DOMAIN_ID, domain_problem
from composer.runtime.middleware.dds_profiles import use_discovery_profile
from composer.runtime.middleware.discovery import use_discovery
from composer.runtime.middleware.shared_memory import remove_incomplete_ports
from composer.runtime.process import StartRefused

if TYPE_CHECKING:
    from composer.model import Discovery

DISCOVERY_RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
_DISABLED = ("", "0", "false", "no", "off")
#: Tokens: https://docs.ros.org/en/jazzy/Tutorials/Demos/Logging-and-logger-configuration.html
CONSOLE_FORMAT = "[{severity}] [{name}] {message}"
#: For ``rclpy.init``: without the log file of rcl, which would nearly always be empty.
ROS_ARGUMENTS = ("--ros-args", "--disable-external-lib-logs")


def check_environment(environment: Mapping[str, str]) -> None:
    """Check everything that ROS will read. Raises StartRefused."""
    for refusal in refusals(environment):
        raise refusal


def refusals(environment: Mapping[str, str]) -> Iterator[StartRefused]:
    """Yield each reason why the environment does not allow a start."""
    for check in _CHECKS:
        try:
            check(environment)
        except StartRefused as refusal:
            yield refusal


def log_folder(environment: Mapping[str, str]) -> Path | None:
    """Return the folder for logs of ROS programs; None without a home folder.

    See https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Logging.html.
    """
    folder, ros_home = environment.get("ROS_LOG_DIR"), environment.get("ROS_HOME")
    home = environment.get("HOME")
    if folder:
        return Path(folder).expanduser()
    if ros_home:
        return Path(ros_home, "log").expanduser()
    return Path(home, ".ros", "log") if home else None


def complete_environment(environment: MutableMapping[str, str]) -> None:
    """Set the variables that rclpy from PyPI leaves unset, and the format of log lines."""
    if Path(sys.prefix, "share", "ament_index").is_dir():
        environment.setdefault("AMENT_PREFIX_PATH", sys.prefix)
    for name, value in {
        "ROS_DISTRO": "jazzy",
        "ROS_VERSION": "2",
        "ROS_PYTHON_VERSION": "3",
    }.items():
        environment.setdefault(name, value)
    environment.setdefault("RCUTILS_CONSOLE_OUTPUT_FORMAT", CONSOLE_FORMAT)


def prepare_environment(discovery: Discovery | None = None) -> None:
    """Check and complete the environment, and remove incomplete shared memory.

    ``discovery`` is that of the system that this process runs. Raises StartRefused. Call it before
    rclpy is imported: the import ends the process if the middleware does not exist.
    """
    complete_environment(os.environ)
    use_discovery_profile(os.environ)
    use_discovery(discovery, os.environ)
    check_environment(os.environ)
    remove_incomplete_ports(int(os.environ.get("ROS_DOMAIN_ID") or 0))


def _check_domain_id(environment: Mapping[str, str]) -> None:
    text = environment.get("ROS_DOMAIN_ID", "")
    if domain_problem(text) is not None:
        raise StartRefused(
            f"ROS_DOMAIN_ID is '{text}', which is not a domain id",
            f"set it to a number from 0 to {HIGHEST_DOMAIN_ID} (up to 101 is safe everywhere)",
        )


def _check_discovery_range(environment: Mapping[str, str]) -> None:
    text = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    if text and text not in DISCOVERY_RANGES:
        similar = nearest(text, DISCOVERY_RANGES)
        hint = f"did you mean {similar}? " if similar else ""
        raise StartRefused(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is '{text}', which is not a discovery range",
            f"{hint}valid values: {', '.join(DISCOVERY_RANGES)}",
        )


def _check_security(environment: Mapping[str, str]) -> None:
    """Refuse to run unsecured if security is enabled.

    For rcl, it is if ROS_SECURITY_ENABLE is exactly ``true``: with ``True`` or ``1``, rcl continues
    without security. So it does with the strategy Permissive if the middleware has no security.
    """
    text = environment.get("ROS_SECURITY_ENABLE", "")
    if text.lower() in _DISABLED:
        return
    if text != "true":
        raise StartRefused(
            f"ROS_SECURITY_ENABLE is '{text}', but ROS enables security only for 'true':"
            " nodes would run unsecured",
            "set ROS_SECURITY_ENABLE=true, or unset it",
        )
    if not environment.get("ROS_SECURITY_KEYSTORE"):
        raise StartRefused(
            "ROS_SECURITY_ENABLE is true, but ROS_SECURITY_KEYSTORE is not set",
            "create one with 'ros2 security create_keystore', or unset ROS_SECURITY_ENABLE",
        )
    if environment.get("ROS_SECURITY_STRATEGY") != "Enforce":
        raise StartRefused(
            "ROS_SECURITY_ENABLE is true, but the strategy is not Enforce: nodes without "
            "keys would run unsecured",
            "set ROS_SECURITY_STRATEGY=Enforce, or unset ROS_SECURITY_ENABLE",
        )


def _check_middleware(environment: Mapping[str, str]) -> None:
    """Refuse a middleware that is not installed. By default, rmw_implementation selects one."""
    selected = environment.get("RMW_IMPLEMENTATION")
    prefixes = environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    index = "share/ament_index/resource_index/rmw_typesupport"
    known = {
        entry.name
        for prefix in prefixes
        if prefix and Path(prefix, index).is_dir()
        for entry in Path(prefix, index).iterdir()
    } - {"rmw_implementation"}
    if selected and known and selected not in known:
        raise StartRefused(
            f"RMW_IMPLEMENTATION is '{selected}', which is not installed",
            f"installed: {', '.join(sorted(known))}",
        )


_CHECKS = (
    _check_domain_id,
    _check_discovery_range,
    _check_security,
    _check_middleware,
)
