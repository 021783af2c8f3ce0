"""What ROS finds when it starts: checked and put in order before.

rclpy starts without complaint with a domain id of -1 or a discovery range nobody knows, and runs
unsecured where security was asked for and is not there. We do not.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping, MutableMapping
from pathlib import Path

from composer.diagnostics import nearest
from composer.runtime.process import StartRefused
from composer.runtime.process.dds_profiles import use_discovery_profile
from composer.runtime.process.shared_memory import remove_incomplete_ports

#: See rcl's domain_id.c; above 101 the ports of a participant may meet the ephemeral ones of Linux.
HIGHEST_DOMAIN_ID = 232
DISCOVERY_RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
#: Tokens: https://docs.ros.org/en/jazzy/Tutorials/Demos/Logging-and-logger-configuration.html
CONSOLE_FORMAT = "[{severity}] [{name}] {message}"


def check_environment(environment: Mapping[str, str]) -> None:
    """Look at everything ROS will read. Raises StartRefused."""
    for refusal in refusals(environment):
        raise refusal


def refusals(environment: Mapping[str, str]) -> Iterator[StartRefused]:
    """Yield every reason why the environment does not allow a start."""
    for check in _CHECKS:
        try:
            check(environment)
        except StartRefused as refusal:
            yield refusal


def log_folder(environment: Mapping[str, str]) -> Path | None:
    """Return where ROS writes its logs; None where nothing says what is at home.

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
    """Fill in what rclpy from PyPI leaves unset, and the format of log lines."""
    if Path(sys.prefix, "share", "ament_index").is_dir():
        environment.setdefault("AMENT_PREFIX_PATH", sys.prefix)
    environment.setdefault("RCUTILS_CONSOLE_OUTPUT_FORMAT", CONSOLE_FORMAT)


def prepare_environment() -> None:
    """Check and complete the environment of this process, and what killed ones left to it.

    Raises StartRefused.

    To be called before rclpy is imported: with a middleware that is not there, the import ends
    the process.
    """
    complete_environment(os.environ)
    use_discovery_profile(os.environ)
    check_environment(os.environ)
    remove_incomplete_ports()


def _check_domain_id(environment: Mapping[str, str]) -> None:
    text = environment.get("ROS_DOMAIN_ID", "")
    if not text:
        return
    if not (text.isascii() and text.isdigit() and int(text) <= HIGHEST_DOMAIN_ID):
        raise StartRefused(
            f"ROS_DOMAIN_ID is '{text}', which is no domain id",
            f"set it to a number from 0 to {HIGHEST_DOMAIN_ID} (up to 101 is safe everywhere)",
        )


def _check_discovery_range(environment: Mapping[str, str]) -> None:
    text = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    if text and text not in DISCOVERY_RANGES:
        close = nearest(text, DISCOVERY_RANGES)
        meant = f"did you mean {close}? " if close else ""
        raise StartRefused(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is '{text}', which is no discovery range",
            f"{meant}valid values: {', '.join(DISCOVERY_RANGES)}",
        )


def _check_security(environment: Mapping[str, str]) -> None:
    """Refuse to run unsecured when security is asked for.

    rcl asks for it when ROS_SECURITY_ENABLE is exactly ``true``; with the strategy Permissive it
    goes on without when the middleware has none.
    """
    if environment.get("ROS_SECURITY_ENABLE") != "true":
        return
    if not environment.get("ROS_SECURITY_KEYSTORE"):
        raise StartRefused(
            "ROS_SECURITY_ENABLE is true, but ROS_SECURITY_KEYSTORE names no keystore",
            "create one with 'ros2 security create_keystore', or unset ROS_SECURITY_ENABLE",
        )
    if environment.get("ROS_SECURITY_STRATEGY") != "Enforce":
        raise StartRefused(
            "ROS_SECURITY_ENABLE is true, but the strategy is not Enforce: nodes without "
            "keys would run unsecured",
            "set ROS_SECURITY_STRATEGY=Enforce, or unset ROS_SECURITY_ENABLE",
        )


def _check_middleware(environment: Mapping[str, str]) -> None:
    """Refuse a middleware that no ROS prefix has; unset, rmw_implementation takes what is there."""
    wanted = environment.get("RMW_IMPLEMENTATION")
    prefixes = environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    index = "share/ament_index/resource_index/rmw_typesupport"
    known = {
        entry.name
        for prefix in prefixes
        if prefix and Path(prefix, index).is_dir()
        for entry in Path(prefix, index).iterdir()
    } - {"rmw_implementation"}
    if wanted and known and wanted not in known:
        raise StartRefused(
            f"RMW_IMPLEMENTATION is '{wanted}', which is not installed",
            f"installed: {', '.join(sorted(known))}",
        )


def _check_log_folder(environment: Mapping[str, str]) -> None:
    """Refuse to start where rcl would: without a folder for its logs."""
    folder = log_folder(environment)
    if folder is None:
        return
    there = next((place for place in (folder, *folder.parents) if os.path.lexists(place)), folder)
    if not os.access(there, os.W_OK | os.X_OK):
        raise StartRefused(
            f"ROS writes its logs to '{folder}', and that is not possible",
            "set ROS_LOG_DIR to a folder that can be written",
        )


_CHECKS = (
    _check_domain_id,
    _check_discovery_range,
    _check_security,
    _check_middleware,
    _check_log_folder,
)
