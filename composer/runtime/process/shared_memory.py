"""Removes shared memory of killed processes that would hang new ones.

Fast DDS opens or creates a shared memory segment for each port. If a process is killed between
creating and filling it, every later participant that opens it waits in its constructor forever,
without reacting to signals: see boost/interprocess/detail/managed_open_or_create_impl.hpp.
"""

from __future__ import annotations

import re
import time
from pathlib import Path

from composer.runtime.process import StartRefused

#: Where Linux keeps it; shm_open(3).
SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 - nothing is written there
_PORT = re.compile(r"fastrtps_port\d+")
#: The first word of a segment: uninitialized, initializing. 2 means initialized.
_UNFINISHED = (0, 1)
_WORD_BYTES = 4
#: Filling a segment takes microseconds: after this time, its process was killed.
_FILLED_WITHIN_S = 1.0
_POLL_S = 0.02


def remove_incomplete_ports(folder: Path = SHARED_MEMORY) -> None:
    """Remove the segments that would hang a new participant.

    Wait up to a second for segments that a process may be filling. Raises StartRefused if one
    belongs to another user.
    """
    if not folder.is_dir():
        return
    for path in sorted(folder.iterdir()):
        if _PORT.fullmatch(path.name) and _stays_incomplete(path):
            _remove(path)


def _stays_incomplete(path: Path) -> bool:
    until_s = time.monotonic() + _FILLED_WITHIN_S
    while (changed_s := _incomplete_since_s(path)) is not None:
        # The clock of files may jump; the monotonic one limits the wait.
        if time.time() - changed_s >= _FILLED_WITHIN_S or time.monotonic() >= until_s:
            return True
        time.sleep(_POLL_S)
    return False


def _incomplete_since_s(path: Path) -> float | None:
    """Return when the segment was last changed if it is incomplete, else None."""
    try:
        with path.open("rb") as segment:
            word = segment.read(_WORD_BYTES)
        if len(word) < _WORD_BYTES or int.from_bytes(word, "little") in _UNFINISHED:
            return path.stat().st_mtime
    except OSError:
        pass  # removed, or not readable: then a participant cannot open it either
    return None


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError as problem:
        raise StartRefused(
            f"cannot remove incomplete shared memory of Fast DDS: {path} ({problem.strerror})",
            f"it would hang this process; remove {path}, or set another ROS_DOMAIN_ID",
        ) from problem
