"""A profile for Fast DDS with which our processes are met at once.

A participant of Fast DDS 2 announces itself to every possible neighbour before it begins to listen
(RTPSParticipantImpl::enable). Who is quick to answer, as everybody on the same computer is, is not
heard; it answers once, and announces itself again within 3 seconds. Both find each other at once or
only then, as chance has it. With the profile, announcing goes on beside the start of listening.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from pathlib import Path

_PROFILE = Path(__file__).with_name("fast_dds.xml")
#: Read by Fast DDS 2 alone; other middleware and later versions have no use for the profile.
_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_OTHER_VARIABLE = "FASTDDS_DEFAULT_PROFILES_FILE"
_SERVER_VARIABLE = "ROS_DISCOVERY_SERVER"
#: Fast DDS reads it in the current folder.
_FILE_OF_USER = "DEFAULT_FASTRTPS_PROFILES.xml"


def complete_discovery(environment: MutableMapping[str, str], folder: Path = Path()) -> None:
    """Choose our profile, unless the user has chosen how Fast DDS discovers.

    ``folder`` is where the process runs.
    """
    variables = (_VARIABLE, _OTHER_VARIABLE, _SERVER_VARIABLE)
    if any(map(environment.get, variables)) or (folder / _FILE_OF_USER).exists():
        return
    environment[_VARIABLE] = str(_PROFILE)


def leave_discovery_alone(environment: MutableMapping[str, str]) -> None:
    """Take our profile back, for a process that leaves in one go (see ``departure``).

    With the profile a participant also says goodbye in a thread of its own, which then ends before
    it has; others wait for the participant for 20 s.
    """
    if environment.get(_VARIABLE) == str(_PROFILE):
        del environment[_VARIABLE]
