"""The CPUs, the priority and the memory limit of a process, and how its threads take turns."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from composer.model import Executor, ExecutorKind, Process
from composer.runtime.executors.factory import place_threads

_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_MEGABYTE = 1e6
#: Python's default is 5 ms.
_SWITCH_INTERVAL_S = 0.001


def switch_threads_sooner() -> None:
    """Let a thread wait less for the interpreter while another one computes.

    See docs/decisions/0069-turns-of-threads.md. A shorter interval that is set already is kept.
    """
    sys.setswitchinterval(min(sys.getswitchinterval(), _SWITCH_INTERVAL_S))


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
