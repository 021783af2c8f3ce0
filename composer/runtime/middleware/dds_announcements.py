"""Lets a process that observes for long announce itself less often."""

from __future__ import annotations

from collections.abc import MutableMapping
from contextlib import suppress

from composer.runtime.middleware.dds_profiles import is_default_profile, save_profile
from composer.runtime.middleware.dds_xml import without

_PROFILES_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"


def announce_less_often(environment: MutableMapping[str, str]) -> None:
    """Select a profile with the default period of announcements, 3 s.

    Each announcement goes to all possible participants of this computer. Other processes answer the
    first one of this process, and it answers theirs. Without a folder to write to, or if the user
    has configured Fast DDS, nothing changes.
    """
    if is_default_profile(environment):
        with suppress(OSError):
            content = without(environment[_PROFILES_VARIABLE], "leaseAnnouncement")
            environment[_PROFILES_VARIABLE] = str(save_profile(content))
