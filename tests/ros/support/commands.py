"""Run commands, systems and plain rclpy nodes in other processes."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.ros.support.forked import ForkedCommand, ForkedProgram

#: Python without the Fast DDS profile of the tests, so that ros2-composer chooses its own.
PYTHON = (
    *("env", "-u", "FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"),
    sys.executable,
)
#: A new interpreter, for tests of how it starts or ends; the functions below fork.
COMPOSE = (*PYTHON, "-m", "composer")
PROGRAMS = Path(__file__).parents[1] / "programs"
PATIENCE_S = 60.0


@contextmanager
def hand_written(program: str, *arguments: str) -> Iterator[ForkedProgram]:
    """Run a program of tests/ros/programs for the length of the block."""
    process = ForkedProgram(PROGRAMS / program, *arguments)
    try:
        # Fast DDS may print there first, about what a killed process left behind.
        assert "ready\n" in process.stdout
        yield process
    finally:
        process.kill()
        process.wait()


class Running:
    """A ``compose run`` in another process."""

    def __init__(self, log: Path, *arguments: str) -> None:
        self.log = log
        with log.open("w") as file:
            self.process = ForkedCommand("run", *arguments, stderr=file)

    def wait_for(self, text: str) -> None:
        until_s = time.monotonic() + PATIENCE_S
        while True:
            has_ended = self.process.poll() is not None  # and has written its whole log, if so
            if text in self.log.read_text():
                return
            assert not has_ended, self.log.read_text()
            assert time.monotonic() < until_s, self.log.read_text()
            time.sleep(0.02)  # poll: nothing announces changes of the file

    def stop(self, number: int = signal.SIGINT) -> tuple[int, str, str]:
        """Send the signal; return exit code, stdout and stderr."""
        self.process.send_signal(number)
        out, _ = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, out, self.log.read_text()


def code_of_end(output: str) -> int:
    """Return the exit code of a system over several processes that was stopped.

    If the machine does not run one of them for a second, its nodes are not moved in time.
    """
    return int(" is stuck and did not " in output or "no time left" in output)


@contextmanager
def running(log: Path, *arguments: str) -> Iterator[Running]:
    run = Running(log, *arguments)
    try:
        yield run
    finally:
        run.process.kill()
        run.process.wait()


def compose(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command and return its result, whatever the exit code."""
    process = start(*map(str, arguments))
    output, error = process.communicate(timeout=PATIENCE_S)
    assert process.returncode is not None
    return subprocess.CompletedProcess(process.args, process.returncode, output, error)


def output_of(*arguments: object) -> str:
    """Run a command that must succeed; return its stdout."""
    done = compose(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def start(*arguments: str) -> ForkedCommand:
    """Start a command."""
    return ForkedCommand(*arguments)


def finished(process: ForkedCommand) -> str:
    """Wait for a started command, which must succeed; return its stdout."""
    output, error = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, error
    return output


def listed(parts: tuple[str, ...], *arguments: str) -> str:
    """Repeat a command until its output contains all parts: discovery may take longer."""
    return repeated_until(lambda text: all(part in text for part in parts), *arguments)


def expect_state(node: str, state: str) -> None:
    """Repeat a command until it reports the lifecycle state of a node."""
    line = f"{state}\n"
    assert repeated_until(lambda text: text == line, "lifecycle", "get", node) == line


def measured(fits: Callable[[dict[str, Any]], bool], *arguments: str) -> dict[str, Any]:
    """Repeat a measurement until it fits: a busy machine distorts rates and delays."""
    text = repeated_until(lambda text: fits(json.loads(text.splitlines()[-1])), *arguments)
    found: dict[str, Any] = json.loads(text.splitlines()[-1])
    return found


def repeated_until(fits: Callable[[str], object], *arguments: object) -> str:
    """Repeat a command until it succeeds and its output fits; return the output."""
    return repeated(lambda done: done.returncode == 0 and fits(done.stdout), *arguments).stdout


def repeated(
    fits: Callable[[subprocess.CompletedProcess[str]], object], *arguments: object
) -> subprocess.CompletedProcess[str]:
    """Repeat a command until its result fits; return it.

    For commands that have the same effect each time: a process that is not scheduled for a moment
    exceeds the time limits of a command, and is discovered late.
    """
    until_s = time.monotonic() + PATIENCE_S
    while True:
        done = compose(*arguments)
        if fits(done):
            return done
        text = f"exit code {done.returncode}\n{done.stdout}\n{done.stderr}"
        assert "Usage: " not in done.stderr, text  # the next ones would be the same
        assert time.monotonic() < until_s, text


def errors(*commands: tuple[object, ...]) -> list[str]:
    """Run commands that must fail in parallel, because they mostly wait; return their stderr."""
    processes = [start(*map(str, arguments)) for arguments in commands]
    results = [process.communicate(timeout=PATIENCE_S) for process in processes]
    for process, (output, text) in zip(processes, results, strict=True):
        assert process.returncode == 1, text
        assert output == "", output
    return [text for _, text in results]


def expect_error(part: str, *arguments: object) -> str:
    """Repeat a command that must fail, until its stderr contains ``part``; return its stderr."""
    done = repeated(lambda done: done.returncode == 1 and part in done.stderr, *arguments)
    assert done.stdout == "", done.stdout
    return done.stderr


def expect_errors(*commands: tuple[object, ...]) -> list[str]:
    """Do so in parallel, because the commands mostly wait; return the stderr of each."""
    with ThreadPoolExecutor(len(commands)) as pool:
        return list(pool.map(lambda words: expect_error(*map(str, words)), commands))


def error(*arguments: object) -> str:
    """Run a command that must fail with an empty stdout; return its stderr."""
    (text,) = errors(arguments)
    return text


class Observer:
    """A plain rclpy process that says which nodes it knows, and how many messages it received."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def wait_until_ready(self) -> None:
        """Wait until it knows the nodes that it expects."""
        assert self._process.stdout is not None
        # Fast DDS may print there first, about what a killed process left behind.
        assert "ready\n" in self._process.stdout

    def ask(self) -> tuple[int, list[str]]:
        """Return the number of messages that it has received, and the nodes that it knows."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        count, *names = self._process.stdout.readline().split()
        return int(count), names


@contextmanager
def observing(
    topic: str, *nodes: str, environment: Mapping[str, str], prefix: tuple[str, ...] = ()
) -> Iterator[Observer]:
    """Run one that expects ``nodes``; ``prefix`` is a command that runs it elsewhere."""
    process = subprocess.Popen(
        [*prefix, sys.executable, str(PROGRAMS / "roles.py"), "observer", topic, *nodes],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )
    try:
        yield Observer(process)
    finally:
        process.kill()
        process.wait()
