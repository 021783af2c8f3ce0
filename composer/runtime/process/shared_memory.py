"""What killed processes leave in shared memory, as far as it would hang the next one.

Fast DDS opens the shared memory segment of a port or makes it, whichever comes first. Where a
process was killed between making and filling it, everybody who opens it later waits for ever, in
the constructor of the participant: before any node is there, and deaf to signals. See
boost/interprocess/detail/managed_open_or_create_impl.hpp for what is waited for.
"""

from __future__ import annotations

import re
import time
from pathlib import Path

from composer.runtime.process import StartRefused

#: Where Linux keeps it; shm_open(3).
SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 - nothing is put there
_PORT = re.compile(r"fastrtps_port\d+")
#: The first word of a segment: uninitialized, initializing. What is ready has a 2 there.
_UNFINISHED = (0, 1)
_WORD_BYTES = 4
#: Filling a segment takes microseconds: who has not done it by then never will.
_PATIENCE_S = 1.0
_STEP_S = 0.02


def remove_incomplete_ports(folder: Path = SHARED_MEMORY) -> None:
    """Remove the segments that would hang a new participant.

    Waits for those that somebody may be filling just now, a second at most. Raises StartRefused
    when one belongs to somebody else.
    """
    if not folder.is_dir():
        return
    for path in sorted(folder.iterdir()):
        if _PORT.fullmatch(path.name) and _stays_half_made(path):
            _remove(path)


def _stays_half_made(path: Path) -> bool:
    until_s = time.monotonic() + _PATIENCE_S
    while (made_s := _half_made_since_s(path)) is not None:
        # The clock of files may jump: nobody waits longer than by the steady one.
        if time.time() - made_s >= _PATIENCE_S or time.monotonic() >= until_s:
            return True
        time.sleep(_STEP_S)
    return False


def _half_made_since_s(path: Path) -> float | None:
    """Return when the segment was last changed if it is half-made, else None."""
    try:
        with path.open("rb") as segment:
            word = segment.read(_WORD_BYTES)
        if len(word) < _WORD_BYTES or int.from_bytes(word, "little") in _UNFINISHED:
            return path.stat().st_mtime
    except OSError:
        pass  # gone, or not ours to read: then it is not ours to open either
    return None


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError as problem:
        raise StartRefused(
            f"shared memory of Fast DDS is half-made: {path} ({problem.strerror})",
            f"a process was killed while it made it, and whoever opens it hangs: remove {path}, or"
            " use another ROS_DOMAIN_ID",
        ) from problem
