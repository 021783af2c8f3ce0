"""Run each measurement in a separate process and ROS domain."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
RESULT_MARK = "RESULT "  # prefix of the line with the result of a program
STARTED_LINE = "STARTED"  # printed at the start of a measurement without a fixed duration
_LOWEST_DOMAIN_ID, _DOMAIN_IDS = 30, 70  # ports of IDs above 101 may collide with ephemeral ports

domain_ids = itertools.cycle(
    _LOWEST_DOMAIN_ID + (os.getpid() + step) % _DOMAIN_IDS for step in range(_DOMAIN_IDS)
)


class ProgramFailed(Exception):
    """A program ended without a result; the message says how."""


def environment() -> Mapping[str, str]:
    """Return an environment with a new ROS domain ID, restricted to this machine."""
    return {
        **os.environ,
        "ROS_DOMAIN_ID": str(next(domain_ids)),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }


@contextmanager
def on_one_processor() -> Iterator[None]:
    """Context manager: all processes started in the block share one processor."""
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})  # the first one usually handles device interrupts
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def wall_time_s(*arguments: str, folder: Path) -> float:
    """Return the wall time of this Python with ``arguments``. Raises CalledProcessError.

    Bytecode is cached, as in an installation, even if the environment disables it.
    """
    compiled = str(Path(tempfile.gettempdir()) / "composer-benchmarks-bytecode")
    variables = {**os.environ, "PYTHONPYCACHEPREFIX": compiled}
    variables.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, *arguments]
    start_s = time.perf_counter()
    subprocess.run(command, cwd=folder, env=variables, check=True, capture_output=True)
    return time.perf_counter() - start_s


@contextmanager
def started(name: str, *arguments: str, variables: Mapping[str, str]) -> Iterator[None]:
    """Context manager: run ``benchmarks.programs.<name>`` during the block."""
    with subprocess.Popen(
        command(name, *arguments),
        cwd=ROOT,
        env=variables,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            yield
        finally:
            process.kill()


def run_program(
    name: str,
    *arguments: str,
    timeout_s: float,
    variables: Mapping[str, str] | None = None,
    python: str = sys.executable,
) -> dict[str, Any]:
    """Run ``benchmarks.programs.<name>`` and return its result. Raises ProgramFailed.

    ``variables`` is its environment, by default one with a new ROS domain.
    """
    try:
        done = subprocess.run(
            command(name, *arguments, python=python),
            cwd=ROOT,
            env=environment() if variables is None else variables,
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise ProgramFailed(f"no result within {timeout_s:g} s") from error
    return result_in(done.stdout, done.stderr, done.returncode)


def result_in(output: str, errors: str, exit_code: int) -> dict[str, Any]:
    """Return the result that a program printed. Raises ProgramFailed if there is none."""
    for line in output.splitlines():
        if line.startswith(RESULT_MARK):
            result: dict[str, Any] = json.loads(line.removeprefix(RESULT_MARK))
            return result
    raise no_result(errors, exit_code)


def no_result(errors: str, exit_code: int) -> ProgramFailed:
    """Return the exception for a program that ended without a result."""
    last = (errors.strip().splitlines() or ["nothing on stderr"])[-1]
    return ProgramFailed(f"exit code {exit_code}: {last}")


def command(name: str, *arguments: str, python: str = sys.executable) -> list[str]:
    """Return the command line of ``benchmarks.programs.<name>``."""
    return [python, "-m", f"benchmarks.programs.{name}", *arguments]
