"""Counters and measurements that all programs share."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.processes import RESULT_MARK, STARTED_LINE
from benchmarks.programs.task import Task

KICK_PERIOD_S = 0.2
_BYTES_PER_MB = 1_000_000
_TIMEOUT_S, _TIMEOUT_S_PER_PART = 5.0, 3.0
WARM_UP_S = 0.3
_OTHERS_LAST_S = 120.0  # longer than any measurement; limits the lifetime of orphaned processes


@dataclass(slots=True)
class Counts:
    """Counters, written by callbacks and read by the main thread.

    ``took_ns`` are latencies and round trips; ``sent_ns`` is when the message in flight was
    published.
    """

    delivered: int = 0
    sent_ns: int = 0
    ticks_ns: list[int] = field(default_factory=list)
    took_ns: list[int] = field(default_factory=list)


COUNTS = Counts()


def needs_kick(seen: int) -> bool:
    """Return whether nothing was delivered since ``seen``: messages before matching are lost."""
    return COUNTS.delivered == seen


def memory_mb() -> float:
    """Return the resident memory of this process."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / _BYTES_PER_MB


def measure(
    task: Task,
    started_s: float,
    kick: Callable[[], None] = lambda: None,
) -> dict[str, Any]:
    """Let the running system work for a while and return the measurements.

    ``kick`` is called until the first delivery; systems that start by themselves need none.
    """
    figures: dict[str, Any] = {
        "start_s": time.perf_counter() - started_s,
        "memory_mb": memory_mb(),
    }
    if task.part:  # the first part measures
        time.sleep(_OTHERS_LAST_S)  # its nodes run on other threads
        os._exit(0)
    parts = 0 if task.part is None else task.nodes
    _wait_for_work(kick, _TIMEOUT_S + _TIMEOUT_S_PER_PART * parts)
    time.sleep(WARM_UP_S)  # caches are cold at first
    delivered, ticks, took = COUNTS.delivered, len(COUNTS.ticks_ns), len(COUNTS.took_ns)
    cpu_s, wall_s = time.process_time(), time.perf_counter()
    _wait_for_the_end(task)
    figures["cpu_s"] = time.process_time() - cpu_s
    figures["wall_s"] = time.perf_counter() - wall_s
    figures["delivered"] = COUNTS.delivered - delivered
    figures["ticks_ns"] = COUNTS.ticks_ns[ticks:]
    figures["took_ns"] = COUNTS.took_ns[took:]
    return figures


def print_result(figures: dict[str, Any]) -> None:
    """Print the result and exit immediately, without tear-down."""
    print(RESULT_MARK + json.dumps(figures), flush=True)
    sys.stderr.flush()
    os._exit(0)


def _wait_for_the_end(task: Task) -> None:
    if task.until_stopped:
        print(STARTED_LINE, flush=True)
        sys.stdin.readline()
    else:
        time.sleep(task.seconds)


def _wait_for_work(kick: Callable[[], None], timeout_s: float) -> None:
    until_s = time.monotonic() + timeout_s
    while not (COUNTS.delivered or COUNTS.ticks_ns or COUNTS.took_ns):
        if time.monotonic() > until_s:
            print(f"no message delivered within {timeout_s:g} s", file=sys.stderr, flush=True)
            os._exit(1)
        kick()
        time.sleep(KICK_PERIOD_S)
