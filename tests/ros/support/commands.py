"""Commands in processes of their own, systems that they run, and nodes for them to look at."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

#: Python, with the settings of Fast DDS that people have who choose nothing: those of the tests are
#: gone, and with that the composer chooses its own.
PYTHON = (
    *("env", "-u", "FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"),
    sys.executable,
)
COMPOSE = (*PYTHON, "-m", "composer")
PROGRAMS = Path(__file__).parents[1] / "programs"
PATIENCE_S = 30.0


@contextmanager
def hand_written(program: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Run a program of tests/ros/programs for the length of the block."""
    command = [sys.executable, str(PROGRAMS / program), *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        # Fast DDS may print there first, about what a killed process left behind.
        assert "ready\n" in process.stdout
        yield process
    finally:
        process.kill()
        process.wait()


class Running:
    """A ``compose run`` in another terminal."""

    def __init__(self, log: Path, *arguments: str) -> None:
        self.log = log
        with log.open("w") as file:
            self.process = subprocess.Popen(
                [*COMPOSE, "run", *arguments], stderr=file, stdout=subprocess.PIPE, text=True
            )

    def wait_for(self, text: str) -> None:
        until_s = time.monotonic() + PATIENCE_S
        while True:
            has_ended = self.process.poll() is not None  # and has said all, if so
            if text in self.log.read_text():
                return
            assert not has_ended, self.log.read_text()
            assert time.monotonic() < until_s, self.log.read_text()
            time.sleep(0.02)  # between two looks at a file that nothing announces

    def stop(self, number: int = signal.SIGINT) -> tuple[int, str, str]:
        """Send the signal; return exit code, stdout and stderr."""
        self.process.send_signal(number)
        out, _ = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, out, self.log.read_text()


@contextmanager
def running(log: Path, *arguments: str) -> Iterator[Running]:
    run = Running(log, *arguments)
    try:
        yield run
    finally:
        run.process.kill()
        run.process.wait()


def compose(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, however it ends."""
    return subprocess.run(
        [*COMPOSE, *map(str, arguments)],
        check=False,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )


def said(*arguments: object) -> str:
    """Run a command that has to succeed and return what it prints."""
    done = compose(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def start(*arguments: str) -> subprocess.Popen[str]:
    """Begin a command."""
    return subprocess.Popen(
        [*COMPOSE, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finished(process: subprocess.Popen[str]) -> str:
    """Return what a command that was begun has printed, once it has ended well."""
    output, error = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, error
    return output


def listed(parts: tuple[str, ...], *arguments: str) -> str:
    """Ask again until all parts are found: on a busy machine discovery outlasts a command."""
    return asked_until(lambda text: all(part in text for part in parts), *arguments)


def measured(fits: Callable[[dict[str, Any]], bool], *arguments: str) -> dict[str, Any]:
    """Measure again until it fits: what else a machine does changes rates and ages for a while."""
    text = asked_until(lambda text: fits(json.loads(text.splitlines()[-1])), *arguments)
    found: dict[str, Any] = json.loads(text.splitlines()[-1])
    return found


def asked_until(fits: Callable[[str], bool], *arguments: str) -> str:
    """Return the first answer that fits, or the last one there is patience for."""
    until_s = time.monotonic() + PATIENCE_S
    while True:
        text = said(*arguments)
        if fits(text) or time.monotonic() > until_s:
            return text


def errors(*commands: tuple[object, ...]) -> list[str]:
    """Run commands that have to fail at the same time, for most of theirs is spent waiting."""
    processes = [start(*map(str, arguments)) for arguments in commands]
    ends = [process.communicate(timeout=PATIENCE_S) for process in processes]
    for process, (output, told) in zip(processes, ends, strict=True):
        assert process.returncode == 1, told
        assert output == ""
    return [told for _, told in ends]


def error(*arguments: str) -> str:
    """Run a command that has to fail and return what it says, having printed nothing."""
    done = compose(*arguments)
    assert done.returncode == 1, done.stderr
    assert done.stdout == ""
    return done.stderr
