"""The CPUs, the priority and the memory limit of a process of a system."""

from __future__ import annotations

import os
from pathlib import Path

from composer.model import Executor, ExecutorKind, Process
from composer.runtime.executors.factory import place_threads

_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_MEGABYTE = 1e6


def place_process(process: Process) -> tuple[str, ...]:
    """Apply the CPUs and the priority to this thread, and so to all that it starts.

    Returns a message for each request that Linux refuses.
    """
    settings = Executor(
        process.name,
        ExecutorKind.EVENTS,
        process.span,
        cpus=process.cpus,
        priority=process.priority,
    )
    return place_threads(settings, (0,))


def memory_excess(process: Process) -> str | None:
    """Return why this process uses too much memory, or None."""
    limit = process.memory_mb
    if limit is None:
        return None
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[1]
    used_mb = int(pages) * _PAGE_BYTES / _MEGABYTE
    if used_mb <= limit.value:
        return None
    return f"process '{process.name}' uses {used_mb:.0f} MB of memory, more than {limit.value:g} MB"
