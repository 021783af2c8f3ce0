"""CPU time and memory of processes on this computer, from one report to the next."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from composer.runtime.process.usage import ProcessUsage, process_usage


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
        self._before: dict[str, ProcessUsage] = {}

    def usage(self, pid: str) -> dict[str, Any] | None:
        """Return the usage of a process; None if there is no such process.

        ``cpu_percent`` is the share of one processor since the last call, None at the first.
        """
        reading = process_usage(pid) if pid.isascii() and pid.isdigit() else None
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
