"""A day's work in little, and whether memory stays where it was."""

from __future__ import annotations

from benchmarks.figures import Row
from benchmarks.processes import run_program

_SETTLED = 0.2  # of the work: by then everything has happened often


def measure(*, long: bool) -> list[Row]:
    """Compare the memory at the end with that after a fifth of the work. Raises ProgramFailed.

    Long is 10 million messages, 10 000 changes of timers and 1000 lifecycle cycles; short is a
    fiftieth of that.
    """
    share = 1.0 if long else 0.02
    figures = run_program("soak", "--share", str(share), timeout_s=3600.0)
    memory_mb = figures["memory_mb"]
    settled_mb = memory_mb[int(len(memory_mb) * _SETTLED)]
    case = f"soak, {figures['messages']} messages"
    return [Row(case, "MB", "after a fifth of it", (memory_mb[-1],), (settled_mb,))]
