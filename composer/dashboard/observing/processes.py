"""CPU time and memory of processes on this computer, from /proc."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Mapping
from typing import Any

from composer.fast_dataclass import dataclass

_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_MB = 1e6
_MAX_BYTES = 4096  # more than it can be
#: Fields of /proc/PID/stat after the name of the command; see proc(5).
_UTIME, _STIME, _THREADS, _STARTED, _RSS = 11, 12, 17, 19, 21


@dataclass(frozen=True, slots=True)
class _Reading:
    at_s: float
    cpu_s: float
    memory_mb: float
    threads: int
    up_s: float


def total(usages: Iterable[Mapping[str, Any] | None]) -> dict[str, Any] | None:
    """Return the usage of several processes together, None if none of them runs."""
    known = [usage for usage in usages if usage is not None]
    if not known:
        return None
    percents = [usage["cpu_percent"] for usage in known]
    return {
        "cpu_percent": None if None in percents else round(sum(percents), 1),
        "memory_mb": round(sum(usage["memory_mb"] for usage in known), 1),
        "threads": sum(usage["threads"] for usage in known),
        "up_s": max(usage["up_s"] for usage in known),
        "processes": len(known),
    }


class ProcessMonitor:
    """The use of the processors by processes, between two calls."""

    def __init__(self) -> None:
        self._before: dict[str, _Reading] = {}

    def usage(self, pid: str) -> dict[str, Any] | None:
        """Return the usage of a process; None if there is no such process.

        ``cpu_percent`` is the share of one processor since the last call, None at the first.
        """
        reading = _read(pid)
        if reading is None:
            self._before.pop(pid, None)
            return None
        before, self._before[pid] = self._before.get(pid), reading
        percent = None
        if before is not None and reading.at_s > before.at_s:
            used_s = max(0.0, reading.cpu_s - before.cpu_s)
            percent = round(100.0 * used_s / (reading.at_s - before.at_s), 1)
        return {
            "cpu_percent": percent,
            "memory_mb": round(reading.memory_mb, 1),
            "threads": reading.threads,
            "up_s": round(reading.up_s, 1),
        }


def _read(pid: str) -> _Reading | None:
    if not pid.isascii() or not pid.isdigit():
        return None
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
    return _Reading(
        at_s=time.monotonic(),
        cpu_s=(int(values[_UTIME]) + int(values[_STIME])) / _TICKS_PER_S,
        memory_mb=int(values[_RSS]) * _PAGE_BYTES / _MB,
        threads=int(values[_THREADS]),
        up_s=time.clock_gettime(time.CLOCK_BOOTTIME) - int(values[_STARTED]) / _TICKS_PER_S,
    )
