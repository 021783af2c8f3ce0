"""Memory usage under a long load."""

from __future__ import annotations

from benchmarks.figures import Row
from benchmarks.processes import run_program

FIFTHS = 5  # of the work: after the first one, caches and pools are filled


def measure(*, long: bool) -> list[Row]:
    """Compare the memory after each fifth of the work with that after the first one.

    The long version has 10 million messages, 10 000 timer changes and 1000 lifecycle cycles; the
    short version has a fiftieth of that. Raises ProgramFailed.
    """
    figures = run_program("soak", "--share", str(1.0 if long else 0.02), timeout_s=3600.0)
    first_mb, *later_mb = after_fifths(figures["memory_mb"])
    case = f"soak, {figures['messages']} messages"
    return [
        Row(f"{case}, after {fifth} fifths", "MB", "after 1 fifth", (memory_mb,), (first_mb,))
        for fifth, memory_mb in enumerate(later_mb, start=2)
    ]


def after_fifths(memory_mb: list[float]) -> list[float]:
    """Return the last sample of each fifth of the samples."""
    return [memory_mb[len(memory_mb) * fifth // FIFTHS - 1] for fifth in range(1, FIFTHS + 1)]
