"""Participants of killed processes, which DDS lists until their lease ends: for 20 s.

A process that was started again in that time has the same nodes, and all of them would be listed
twice.
"""

from __future__ import annotations

import os
from collections.abc import Set
from pathlib import Path

from composer.runtime.middleware.dds_participants import count_participants

#: The prefix of a participant of Fast DDS: its vendor, the computer, and the lower half of the
#: process id, with the lowest byte first.
_FAST_DDS = b"\x01\x0f"
_HOST, _PROCESS = slice(2, 4), slice(4, 6)
_LOWER_HALF = 0xFFFF


def ended_participants(known: Set[bytes], domain_id: int) -> frozenset[bytes]:
    """Return which of the ``known`` participants have ended, by their prefixes.

    None unless that is certain. Processes of containers have process ids of their own, but their
    participants hold ports of this computer: the remaining ones must be as many as these.
    """
    own = [prefix for prefix in known if _process(prefix) == os.getpid() & _LOWER_HALF]
    hosts = {prefix[_HOST] for prefix in own}
    local = {prefix for prefix in known if prefix[_HOST] in hosts}
    running = {int(path.name) & _LOWER_HALF for path in Path("/proc").glob("[0-9]*")}
    ended = {prefix for prefix in local if _process(prefix) not in running}
    is_certain = len(local) - len(ended) == count_participants(domain_id)
    return frozenset(ended) if is_certain else frozenset()


def _process(prefix: bytes) -> int | None:
    """Return the lower half of the id of the process of a participant, None if unknown."""
    is_known = prefix.startswith(_FAST_DDS)
    return int.from_bytes(prefix[_PROCESS], "little") if is_known else None
