"""CPU usage of systems/pipeline.yaml compared to a hand-written equivalent.

The CPU time of the whole process is measured once all nodes are active. Both programs must publish
at the expected rates, so that doing less does not count as an improvement.
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
_ENOUGH = 0.9  # of the expected messages: timers skip calls on a busy machine
_TIMEOUT_S = 30.0
_SETTLE_S = 0.5
_PROCESS_CPU_CLOCK = 2  # CPUCLOCK_SCHED of Linux
_NODE_LINE = re.compile(
    r"^/\S+/(?:sensor_simulator|motor_controller)\s+\S+\s+\d+\s+(\d+)", re.MULTILINE
)
_HAND_LINE = re.compile(r'"(?:sensor_data|motor_commands)": (\d+)')


@dataclass(frozen=True, slots=True)
class Side:
    """A program: its command, the text printed when it is up, and the counts of sent messages."""

    command: tuple[str, ...]
    ready: str
    sent: re.Pattern[str]


COMPOSED = Side(
    ("-m", "composer", "run", "systems/pipeline.yaml"), "3 of 3 nodes active", _NODE_LINE
)
HAND_WRITTEN = Side(("-m", "benchmarks.baseline_pipeline"), "ready", _HAND_LINE)


def measure(*, long: bool) -> list[Row]:
    """Measure both alternately. Raises ProgramFailed."""
    rounds, seconds = (7, 10.0) if long else (3, 3.0)
    ours: list[float] = []
    theirs: list[float] = []
    for turn in range(rounds):
        sides = [(COMPOSED, ours), (HAND_WRITTEN, theirs)]
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
    """Run one program and return its CPU usage. Raises ProgramFailed."""
    with running(side, environment()) as (process, output):
        up_s = time.perf_counter()
        time.sleep(_SETTLE_S)
        before_s, began_s = cpu_s(process.pid), time.perf_counter()
        time.sleep(seconds)
        used_s, took_s = cpu_s(process.pid) - before_s, time.perf_counter() - began_s
        process.send_signal(signal.SIGINT)
        lived_s = time.perf_counter() - up_s
        process.wait(_TIMEOUT_S)
        text = read(output)
    sent_hz = sum(int(count) for count in side.sent.findall(text)) / lived_s
    if "driving to" not in text or sent_hz < _ENOUGH * EXPECTED_HZ:
        raise ProgramFailed(f"{side.command}: {sent_hz:.0f} messages/s, {EXPECTED_HZ:g} expected")
    return 1000.0 * used_s / took_s


@contextmanager
def running(
    side: Side, variables: Mapping[str, str], timeout_s: float = _TIMEOUT_S
) -> Iterator[tuple[subprocess.Popen[bytes], IO[bytes]]]:
    """Context manager: run a program; the block is entered once the program is up.

    ``variables`` is its environment. Raises ProgramFailed if it does not come up in time.
    """
    command: Sequence[str] = (sys.executable, *side.command)
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(
            command, cwd=ROOT, env=variables, stdout=output, stderr=subprocess.STDOUT
        )
        try:
            _wait_until_up(process, output, side.ready, timeout_s)
            yield process, output
        finally:
            process.kill()
            process.wait()


def _wait_until_up(
    process: subprocess.Popen[bytes], output: IO[bytes], ready: str, timeout_s: float
) -> None:
    until_s = time.monotonic() + timeout_s
    while ready not in read(output):
        if process.poll() is not None or time.monotonic() > until_s:
            raise ProgramFailed(f"did not come up: {read(output)[-500:]}")
        time.sleep(0.05)


def read(output: IO[bytes]) -> str:
    """Return the output so far."""
    # Do not seek: the process shares the file position.
    size = os.fstat(output.fileno()).st_size
    return os.pread(output.fileno(), size, 0).decode(errors="replace")


def cpu_s(pid: int) -> float:
    """Return the CPU time of a process in seconds."""
    # The CPU clock of the process, see clock_getcpuclockid(3); /proc has a resolution of 10 ms.
    return time.clock_gettime((~pid << 3) | _PROCESS_CPU_CLOCK)
