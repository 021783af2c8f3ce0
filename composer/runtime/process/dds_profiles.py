"""Profiles for Fast DDS with which our processes are met at once, and miss what was lost soon.

A participant of Fast DDS 2 announces itself to every possible neighbour before it begins to listen
(RTPSParticipantImpl::enable). Who is quick to answer, as everybody on the same computer is, is not
heard; it answers once, and announces itself again within 3 seconds. Both find each other at once or
only then, as chance has it. With the profile, announcing goes on beside the start of listening.
Of two participants in one process, of which we have one, with the profile one does not notice that
an endpoint of the other is gone: what Fast DDS hands over within a process misses that thread.

Commands do without shared memory, too. Before Fast DDS first writes to somebody's port in shared
memory it looks whether somebody listens there (SharedMemGlobal::Port::healthy_check). For up to a
third of each second an idle listener looks dead to it; then it sleeps for a third of a second, and
with it all that this process sends and receives. That would be one command in ten.

With the profile a participant says goodbye in that thread, too, which often ends before it has:
others wait for the participant until its lease is over. That of a command is short.

A reliable publisher that has lost its last message hears of it with its next heartbeat, by default
after up to 3 s. With the profile that is 0.2 s; heartbeats are sent while something is not
acknowledged. By default it also wakes a thread after each message, to say that this may be missed
by now, a quarter of what a message to another process costs; with the profile once in 4 ms.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from pathlib import Path

_PROFILE = Path(__file__).with_name("fast_dds.xml")
_PROFILE_FOR_LARGE_SYSTEMS = Path(__file__).with_name("fast_dds_large.xml")
_PROFILE_OF_COMMANDS = Path(__file__).with_name("fast_dds_commands.xml")
_PROFILE_FOR_LOCALHOST = Path(__file__).with_name("fast_dds_commands_localhost.xml")
#: Read by Fast DDS 2 alone; other middleware and later versions have no use for the profile.
_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_OTHER_VARIABLE = "FASTDDS_DEFAULT_PROFILES_FILE"
_SERVER_VARIABLE = "ROS_DISCOVERY_SERVER"
_TRANSPORTS_VARIABLE = "FASTDDS_BUILTIN_TRANSPORTS"
_UDP = "UDPv4"
_RANGE_VARIABLE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
#: What our profile for this computer alone does not say.
_OTHER_RANGE_VARIABLES = ("ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY")
#: Fast DDS reads it in the current folder.
_FILE_OF_USER = "DEFAULT_FASTRTPS_PROFILES.xml"


def use_discovery_profile(environment: MutableMapping[str, str], folder: Path = Path()) -> None:
    """Choose our profile, unless the user has chosen how Fast DDS discovers.

    ``folder`` is where the process runs.
    """
    variables = (_VARIABLE, _OTHER_VARIABLE, _SERVER_VARIABLE)
    if any(map(environment.get, variables)) or (folder / _FILE_OF_USER).exists():
        return
    environment[_VARIABLE] = str(_PROFILE)


def use_command_profile(environment: MutableMapping[str, str]) -> None:
    """Have Fast DDS use UDP alone, and others forget us soon, unless the user has chosen otherwise.

    With the range LOCALHOST rmw_fastrtps adds shared memory whatever a profile says. There our
    profile says what the range means, and the range is left to it.
    """
    chosen = environment.get(_TRANSPORTS_VARIABLE) or _UDP
    if environment.get(_VARIABLE) != str(_PROFILE) or chosen != _UDP:
        return
    if environment.get(_RANGE_VARIABLE) != "LOCALHOST":
        environment[_VARIABLE] = str(_PROFILE_OF_COMMANDS)
        environment[_TRANSPORTS_VARIABLE] = _UDP
    elif not any(map(environment.get, _OTHER_RANGE_VARIABLES)):
        environment[_VARIABLE] = str(_PROFILE_FOR_LOCALHOST)
        environment[_RANGE_VARIABLE] = "SYSTEM_DEFAULT"


def use_large_system_profile(environment: MutableMapping[str, str]) -> None:
    """Take back what concerns discovery, for a process that leaves in one go (see ``departure``).

    With the profile a participant also says goodbye in a thread of its own, which then ends before
    it has; others wait for the participant for 20 s.
    """
    if environment.get(_VARIABLE) == str(_PROFILE):
        environment[_VARIABLE] = str(_PROFILE_FOR_LARGE_SYSTEMS)
