"""Runs scenarios side by side, each in a process of its own.

A process runs one scenario: rclpy has one context, and modules of user code have state. The
processes are forks of this one, which has imported everything and started no thread, so each starts
within milliseconds.
"""

from __future__ import annotations

import faulthandler
import os
import pickle
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import field
from functools import partial
from pathlib import Path
from selectors import EVENT_READ, DefaultSelector
from tempfile import TemporaryFile
from typing import IO

from composer.base.fast_dataclass import dataclass
from composer.model import System
from composer.model.scenario import Scenario
from composer.scenarios.expectations import Failure
from composer.scenarios.runner import Options, Result, run_scenario

_CHUNK = 1 << 16
_MOST_OUTPUT = 20_000  # characters of what a failed run has printed
_TO_PRINT_S = 2.0


@dataclass(frozen=True, slots=True)
class Job:
    """A scenario to run. ``bag`` is the folder of a new bag for the run."""

    scenario: Scenario
    system: System
    bag: Path | None = None


@dataclass(slots=True)
class _Process:
    job: Job
    number: int
    pid: int
    pipe: int
    output: IO[bytes]
    until_s: float
    content: bytearray = field(default_factory=bytearray)
    is_late: bool = False


def run_jobs(
    jobs: Sequence[Job], options: Options, workers: int, timeout_s: float
) -> Iterator[Result]:
    """Yield the results of the jobs, in their order. A run that takes longer is killed."""
    results: dict[int, Result] = {}
    following = 0
    with _running() as running, DefaultSelector() as selector:
        waiting = list(enumerate(jobs))[::-1]
        while following < len(jobs):
            while waiting and len(running) < workers:
                process = _start(*waiting.pop(), options, timeout_s)
                running.append(process)
                selector.register(process.pipe, EVENT_READ, process)
            nearest_s = min(process.until_s for process in running)
            for key, _ in selector.select(max(nearest_s - time.monotonic(), 0.0)):
                process = key.data
                chunk = os.read(process.pipe, _CHUNK)
                process.content += chunk
                if not chunk:
                    selector.unregister(process.pipe)
                    running.remove(process)
                    results[process.number] = _result(process)
            for process in [item for item in running if item.until_s <= time.monotonic()]:
                # The first signal lets it print the stacks of its threads.
                os.kill(process.pid, signal.SIGKILL if process.is_late else signal.SIGABRT)
                process.is_late = True
                process.until_s += _TO_PRINT_S
            while following in results:
                yield results.pop(following)
                following += 1


@contextmanager
def _running() -> Iterator[list[_Process]]:
    """Yield a list of processes, and kill those that are still in it in the end."""
    running: list[_Process] = []
    try:
        yield running
    finally:
        for process in running:
            os.kill(process.pid, signal.SIGKILL)
            os.waitpid(process.pid, 0)


def _start(number: int, job: Job, options: Options, timeout_s: float) -> _Process:
    reading, writing = os.pipe()
    output = TemporaryFile()  # noqa: SIM115 - closed with the result
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid == 0:
        run = partial(run_scenario, job.scenario, job.system, options, job.bag)
        _run_and_exit(writing, output.fileno(), run)
    os.close(writing)
    lasting_s = job.scenario.for_s.value if options.real_time else 0.0
    until_s = time.monotonic() + timeout_s + lasting_s
    return _Process(job, number, pid, reading, output, until_s)


def _run_and_exit(pipe: int, output: int, run: Callable[[], Result]) -> None:
    """Run in the new process, which ends here: nothing of its parent may happen in it."""
    try:
        os.dup2(output, 1)
        os.dup2(output, 2)
        sys.stdout = sys.stderr = os.fdopen(1, "w", buffering=1)
        faulthandler.enable()
        with os.fdopen(pipe, "wb") as stream:
            pickle.dump(run(), stream)
        os._exit(0)
    except BaseException:
        sys.excepthook(*sys.exc_info())
        os._exit(1)


def _result(process: _Process) -> Result:
    os.close(process.pipe)
    _, status = os.waitpid(process.pid, 0)
    with process.output as file:
        file.seek(0)
        output = file.read().decode(errors="replace")[-_MOST_OUTPUT:]
    try:
        result: Result = pickle.loads(process.content)  # noqa: S301 - from our own process
    except (EOFError, pickle.UnpicklingError):
        code = os.waitstatus_to_exitcode(status)
        seen = f"it ended with code {code}" if code >= 0 else f"signal {-code} has ended it"
        if process.is_late:
            seen = "it was still running at the time limit: the output shows where"
        failure = Failure(process.job.scenario.name.span, "the process of the run to end", seen)
        bag = process.job.bag
        recorded = [] if bag is None else [f"recorded until the process ended: {bag}"]
        result = Result([failure], recorded=recorded)
    result.output = output if result.failures else ""
    return result
