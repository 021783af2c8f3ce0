"""When this process started."""

from __future__ import annotations

import os
import time
from pathlib import Path

#: In what follows the name of the program in /proc/PID/stat; see proc(5).
_START_TICKS = 19


def process_start_s() -> float:
    """Return when this process started, by ``time.monotonic()``; now if that cannot be read.

    Python may have been started again in it, as by the ROS wheels. Linux counts steps of 10 ms.
    """
    try:
        text = Path("/proc/self/stat").read_text(encoding="utf-8", errors="replace")
        ticks = int(text.rpartition(")")[2].split()[_START_TICKS])
    except (OSError, ValueError, IndexError):
        return time.monotonic()
    age_s = time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
    return time.monotonic() - max(0.0, age_s)
