"""Plain rclpy processes that say which nodes they know, and how many messages they received."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from tests.ros.support.commands import PROGRAMS

PROGRAM = (sys.executable, str(PROGRAMS / "roles.py"), "observer")


class Observer:
    """One of these processes."""

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
        [*prefix, *PROGRAM, topic, *nodes],
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
