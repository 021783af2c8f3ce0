"""CPU time, memory and age of processes on this computer, from /proc."""

from __future__ import annotations

import os
import time

from composer.base.fast_dataclass import dataclass

_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_MB = 1e6
_MAX_BYTES = 4096  # more than it can be
#: Fields of /proc/PID/stat after the name of the command; see proc(5).
_UTIME, _STIME, _THREADS, _STARTED, _RSS = 11, 12, 17, 19, 21


@dataclass(frozen=True, slots=True)
class ProcessUsage:
    """What a process has used until ``at_s``, by ``time.monotonic()``; ``up_s`` is its age."""

    at_s: float
    cpu_s: float
    memory_mb: float
    threads: int
    up_s: float


def process_usage(pid: str) -> ProcessUsage | None:
    """Return the usage of a process, or of this one for ``self``; None if it cannot be read."""
    try:
        descriptor = os.open(f"/proc/{pid}/stat", os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        text = os.read(descriptor, _MAX_BYTES).decode("utf-8", errors="replace")
    except OSError:
        return None
    finally:
        os.close(descriptor)
    values = text.rpartition(")")[2].split()
    return ProcessUsage(
        at_s=time.monotonic(),
        cpu_s=(int(values[_UTIME]) + int(values[_STIME])) / _TICKS_PER_S,
        memory_mb=int(values[_RSS]) * _PAGE_BYTES / _MB,
        threads=int(values[_THREADS]),
        up_s=time.clock_gettime(time.CLOCK_BOOTTIME) - int(values[_STARTED]) / _TICKS_PER_S,
    )


def process_start_s() -> float:
    """Return when this process started, by ``time.monotonic()``; now if that cannot be read.

    Python may have been started again in it, as by the ROS wheels. Linux counts steps of 10 ms.
    """
    usage = process_usage("self")
    return time.monotonic() - (0.0 if usage is None else max(0.0, usage.up_s))
