"""Waiting for what nothing announces, and the states of processes."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

PATIENCE_S = 60.0


def wait_until(condition: Callable[[], object], what: str, limit_s: float = PATIENCE_S) -> None:
    """Wait until ``condition()`` is true; fail after ``limit_s``."""
    end_s = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end_s, f"timed out: {what}"
        time.sleep(0.002)


def status_of(pid: int) -> tuple[str, int]:
    """Return the state of a process, as in ps, and the id of its parent; ``X`` if it is gone."""
    try:
        stat = Path("/proc", str(pid), "stat").read_text(encoding="utf-8")
    except (FileNotFoundError, ProcessLookupError):
        return "X", 0
    state, parent = stat.rpartition(")")[2].split()[:2]
    return state, int(parent)


def is_alive(pid: int) -> bool:
    return status_of(pid)[0] not in "XZ"
