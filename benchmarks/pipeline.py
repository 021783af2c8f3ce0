"""The tutorial's pipeline: ``compose run`` against the same written by hand.

CPU of the whole process, all its threads, as the kernel counts it, once everything runs. Both have
to have sent what their timers promise, so that nobody wins by doing less.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import IO

from benchmarks.figures import Row
from benchmarks.processes import ROOT, ProgramFailed, environment

EXPECTED_HZ = 30.0 + 50.0  # odometry and motor commands
_ENOUGH = 0.9  # of what was expected: the timers of a busy machine skip some
_PATIENCE_S = 30.0
_SETTLE_S = 0.5
_PROCESS_CPU_CLOCK = 2  # CPUCLOCK_SCHED of Linux
_NODE_LINE = re.compile(
    r"^/\S+/(?:sensor_simulator|motor_controller)\s+\S+\s+\d+\s+(\d+)", re.MULTILINE
)
_HAND_LINE = re.compile(r'"(?:sensor_data|motor_commands)": (\d+)')


@dataclass(frozen=True, slots=True)
class Side:
    """One of the two: how it is started, what it says when it is up, how it tells what it sent."""

    command: tuple[str, ...]
    ready: str
    sent: re.Pattern[str]


COMPOSED = Side(
    ("-m", "composer", "run", "systems/pipeline.yaml"), "3 of 3 nodes active", _NODE_LINE
)
BY_HAND = Side(("-m", "benchmarks.baseline_pipeline"), "ready", _HAND_LINE)


def measure(*, long: bool) -> list[Row]:
    """Let both run in turn. Raises ProgramFailed."""
    rounds, seconds = (7, 10.0) if long else (3, 3.0)
    ours: list[float] = []
    theirs: list[float] = []
    for turn in range(rounds):
        sides = [(COMPOSED, ours), (BY_HAND, theirs)]
        for side, figures in sides if turn % 2 == 0 else reversed(sides):
            figures.append(cpu_ms_per_s(side, seconds))
    return [
        Row(
            "pipeline.yaml",
            "CPU ms/s",
            "rclpy, SingleThreadedExecutor",
            tuple(ours),
            tuple(theirs),
        )
    ]


def cpu_ms_per_s(side: Side, seconds: float) -> float:
    """Run one side and return what CPU it took. Raises ProgramFailed."""
    with running(side, environment()) as (process, output):
        up_s = time.perf_counter()
        time.sleep(_SETTLE_S)
        cpu_s, began_s = _cpu_s(process.pid), time.perf_counter()
        time.sleep(seconds)
        cpu_s, took_s = _cpu_s(process.pid) - cpu_s, time.perf_counter() - began_s
        process.send_signal(signal.SIGINT)
        lived_s = time.perf_counter() - up_s
        process.wait(_PATIENCE_S)
        text = _read(output)
    sent_hz = sum(int(count) for count in side.sent.findall(text)) / lived_s
    if "driving to" not in text or sent_hz < _ENOUGH * EXPECTED_HZ:
        raise ProgramFailed(f"{side.command}: {sent_hz:.0f} messages/s, {EXPECTED_HZ:g} expected")
    return 1000.0 * cpu_s / took_s


@contextmanager
def running(
    side: Side, variables: Mapping[str, str]
) -> Iterator[tuple[subprocess.Popen[bytes], IO[bytes]]]:
    """Let one side run for the length of the block, which begins when it is up.

    ``variables`` is its environment. Raises ProgramFailed when it does not come up.
    """
    command: Sequence[str] = (sys.executable, *side.command)
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(
            command, cwd=ROOT, env=variables, stdout=output, stderr=subprocess.STDOUT
        )
        try:
            _wait_until_up(process, output, side.ready)
            yield process, output
        finally:
            process.kill()
            process.wait()


def _wait_until_up(process: subprocess.Popen[bytes], output: IO[bytes], ready: str) -> None:
    until_s = time.monotonic() + _PATIENCE_S
    while ready not in _read(output):
        if process.poll() is not None or time.monotonic() > until_s:
            raise ProgramFailed(f"did not come up: {_read(output)[-500:]}")
        time.sleep(0.05)


def _read(output: IO[bytes]) -> str:
    # Not by seeking: the process writes at the same position of the same open file.
    size = os.fstat(output.fileno()).st_size
    return os.pread(output.fileno(), size, 0).decode(errors="replace")


def _cpu_s(pid: int) -> float:
    # The process's CPU clock, as clock_getcpuclockid(3) names it: /proc counts in steps of 10 ms.
    return time.clock_gettime((~pid << 3) | _PROCESS_CPU_CLOCK)
