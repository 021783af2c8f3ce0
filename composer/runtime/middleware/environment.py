"""The environment variables that ROS reads when it starts, and the Fast DDS profile of a process.

rclpy accepts a domain id of -1 and unknown discovery ranges without an error, and runs unsecured if
security is enabled but not available. Here, these are errors.

The ``discovery`` of a system becomes variables too: child processes inherit them, and the tools of
ROS use the same ones. What the user has set in the environment takes precedence, as everywhere in
ROS. The profile is selected unless the user has configured Fast DDS: with the default
configuration, two participants that start at the same time may discover each other 3 s late, lost
messages are resent after up to 3 s, and one command in ten sleeps for a third of a second. See
docs/decisions/0011-fast-dds.md.
"""

from __future__ import annotations

import errno
import hashlib
import os
import sys
from collections.abc import Iterator, Mapping, MutableMapping
from pathlib import Path
from typing import TYPE_CHECKING

from composer.base.diagnostics import nearest
from composer.base.folders import TrustedUsers
from composer.model.hosts import HIGHEST_DOMAIN_ID, domain_problem
from composer.runtime.middleware.local_resources import (
    remove_dead_segments,
    remove_incomplete_ports,
)
from composer.runtime.process import StartRefused
from composer.runtime.process.instance_lock import FOLDER_NAME, local_discovery, private_path

if TYPE_CHECKING:
    from composer.model import Discovery


#: These say where others are found.
_WHERE = ("ROS_DISCOVERY_SERVER", "ROS_STATIC_PEERS")
_VARIABLES = (*_WHERE, "ROS_SUPER_CLIENT", "ROS_AUTOMATIC_DISCOVERY_RANGE")
DISCOVERY_RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
_DISABLED = ("", "0", "false", "no", "off")
#: Tokens: https://docs.ros.org/en/jazzy/Tutorials/Demos/Logging-and-logger-configuration.html
CONSOLE_FORMAT = "[{severity}] [{name}] {message}"
#: For ``rclpy.init``: without the log file of rcl, which would nearly always be empty.
ROS_ARGUMENTS = ("--ros-args", "--disable-external-lib-logs")
_PROFILE = Path(__file__).with_name("fast_dds.xml")
_PROFILE_FOR_LARGE_SYSTEMS = Path(__file__).with_name("fast_dds_large.xml")
_PROFILE_FOR_COMMANDS = Path(__file__).with_name("fast_dds_commands.xml")
_PROFILE_FOR_COMMANDS_ON_LOCALHOST = Path(__file__).with_name("fast_dds_commands_localhost.xml")
#: Read by Fast DDS 2 only; other middleware and later versions do not need the profile.
PROFILES_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_OTHER_VARIABLE = "FASTDDS_DEFAULT_PROFILES_FILE"
_SERVER_VARIABLE = "ROS_DISCOVERY_SERVER"
TRANSPORTS_VARIABLE = "FASTDDS_BUILTIN_TRANSPORTS"
_UDP = "UDPv4"
RANGE_VARIABLE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
#: Variables that the profile for localhost does not replace.
_OTHER_RANGE_VARIABLES = ("ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY")
#: The names of profiles that are written at run time.
_GENERATED = "fast_dds_"
#: Fast DDS reads it from the current folder, also if there is a profile.
_USER_FILE = "DEFAULT_FASTRTPS_PROFILES.xml"
_SKIP_USER_FILE_VARIABLE = "SKIP_DEFAULT_XML_FILE"


def use_discovery(discovery: Discovery | None, environment: MutableMapping[str, str]) -> None:
    """Set what the processes of a system need, unless the environment says something else.

    Call it after the profile has been selected.
    """
    _set_missing(active_variables(discovery, environment), environment)


def discovery_conflict(discovery: Discovery, environment: Mapping[str, str]) -> str | None:
    """Return why the environment does not allow the discovery of a system; None if it does."""
    for name in _WHERE:
        given = environment.get(name)
        if given and given != discovery.variables.get(name):
            return f"'discovery' of the system is not used: {name} is set to '{given}'"
    return None


def active_variables(discovery: Discovery | None, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variables of a system's discovery; none if the environment does not allow it."""
    if discovery is None or discovery_conflict(discovery, environment) is not None:
        return {}
    return discovery.variables


def adopt_discovery(environment: MutableMapping[str, str]) -> str | None:
    """Set what a command needs to discover the systems that run on this computer.

    What is set already takes precedence. Return a warning if the systems are discovered in
    different ways: a process can use one of them.
    """
    if any(map(environment.get, _WHERE)):
        return None
    found = {
        name: {key: value for key, value in variables.items() if key in _VARIABLES}
        for name, variables in local_discovery().items()
    }
    different = {tuple(variables.items()) for variables in found.values()}
    if len(different) > 1:
        listed = "; ".join(
            f"{name}: {as_assignments(variables) or 'multicast'}"
            for name, variables in sorted(found.items())
        )
        return (
            "the systems on this computer are discovered in different ways, and this command finds"
            f" those with multicast; export the variables of another one ({listed})"
        )
    for variables in different:
        _set_missing(dict(variables), environment)
    return None


def as_assignments(variables: Mapping[str, str]) -> str:
    """Return the variables as a shell takes them after ``export``."""
    return " ".join(
        f"{name}='{value}'" if ";" in value else f"{name}={value}"
        for name, value in variables.items()
    )


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
    """Check and complete the environment, and remove what killed processes left in shared memory.

    ``discovery`` is that of the system that this process runs. Raises StartRefused. Call it before
    rclpy is imported: the import ends the process if the middleware does not exist.
    """
    complete_environment(os.environ)
    use_discovery_profile(os.environ)
    use_discovery(discovery, os.environ)
    check_environment(os.environ)
    remove_incomplete_ports(int(os.environ.get("ROS_DOMAIN_ID") or 0))
    remove_dead_segments()


def use_discovery_profile(environment: MutableMapping[str, str], folder: Path = Path()) -> None:
    """Select the default profile, unless the user has configured the discovery of Fast DDS.

    ``folder`` is the current folder. A configuration in it that belongs to another user is ignored:
    it could send all messages to another computer.
    """
    user_file = folder / _USER_FILE
    if TrustedUsers.starting_at(folder).other_owner(user_file) is not None:
        environment[_SKIP_USER_FILE_VARIABLE] = "1"
    if _is_generated(environment):  # by the process that has started this one
        environment[PROFILES_VARIABLE] = str(_PROFILE)
    variables = (PROFILES_VARIABLE, _OTHER_VARIABLE, _SERVER_VARIABLE)
    if any(map(environment.get, variables)):
        return
    if user_file.exists() and not environment.get(_SKIP_USER_FILE_VARIABLE):
        return
    environment[PROFILES_VARIABLE] = str(_PROFILE)


def is_own_profile(environment: Mapping[str, str]) -> bool:
    """Say whether a system uses one of our profiles: the user has not configured Fast DDS."""
    path = environment.get(PROFILES_VARIABLE)
    ours = (str(_PROFILE), str(_PROFILE_FOR_LARGE_SYSTEMS))
    return path in ours or _is_generated(environment)


def is_default_profile(environment: Mapping[str, str]) -> bool:
    """Return whether :func:`use_discovery_profile` has set the profile."""
    return environment.get(PROFILES_VARIABLE) == str(_PROFILE)


def save_profile(content: str) -> Path:
    """Write a profile to the folder of the lock files, and return its path. Raises OSError.

    The file name follows from the content: processes of a system share the file, also those that
    start later.
    """
    name = f"{_GENERATED}{hashlib.sha256(content.encode()).hexdigest()[:16]}.xml"
    path = private_path(name)
    if path is None:
        raise FileNotFoundError(errno.ENOENT, "there is no private folder for it", name)
    partial = path.with_suffix(f".{os.getpid()}")  # other processes may read the file now
    partial.write_text(content, encoding="utf-8")
    partial.replace(path)
    return path


def use_command_profile(environment: MutableMapping[str, str]) -> None:
    """Select the profile for commands, with UDP only and a short lease, unless the user has one.

    With the range LOCALHOST, rmw_fastrtps adds shared memory to any profile. Therefore the profile
    for localhost implements that range itself, and the variable is reset.
    """
    transports = environment.get(TRANSPORTS_VARIABLE) or _UDP
    if environment.get(PROFILES_VARIABLE) != str(_PROFILE) or transports != _UDP:
        return
    if environment.get(RANGE_VARIABLE) != "LOCALHOST":
        environment[PROFILES_VARIABLE] = str(_PROFILE_FOR_COMMANDS)
        environment[TRANSPORTS_VARIABLE] = _UDP
    elif not any(map(environment.get, _OTHER_RANGE_VARIABLES)):
        environment[PROFILES_VARIABLE] = str(_PROFILE_FOR_COMMANDS_ON_LOCALHOST)
        environment[RANGE_VARIABLE] = "SYSTEM_DEFAULT"


def use_large_system_profile(environment: MutableMapping[str, str]) -> None:
    """Select the profile for a process that ends with a fast exit.

    With the default profile, a thread announces the end of a participant. A fast exit would stop
    the thread first, and other processes would show the participant for 20 s.
    """
    if environment.get(PROFILES_VARIABLE) == str(_PROFILE):
        environment[PROFILES_VARIABLE] = str(_PROFILE_FOR_LARGE_SYSTEMS)


def _set_missing(variables: Mapping[str, str], environment: MutableMapping[str, str]) -> None:
    for name, value in variables.items():
        if not environment.get(name):
            environment[name] = value


def _is_generated(environment: Mapping[str, str]) -> bool:
    path = Path(environment.get(PROFILES_VARIABLE) or "")
    return path.parent.name == FOLDER_NAME and path.name.startswith(_GENERATED)


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
