"""Selects the Fast DDS profile of this process, unless the user has configured Fast DDS.

With the default configuration, two participants that start at the same time may discover each other
3 s late, lost messages are resent after up to 3 s, and one command in ten sleeps for a third of a
second. See docs/decisions/0011-fast-dds.md.
"""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Mapping, MutableMapping
from pathlib import Path

from composer.base.ownership import TrustedUsers
from composer.runtime.process.instance_lock import FOLDER_NAME, private_path

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


def _is_generated(environment: Mapping[str, str]) -> bool:
    path = Path(environment.get(PROFILES_VARIABLE) or "")
    return path.parent.name == FOLDER_NAME and path.name.startswith(_GENERATED)


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
