"""Ctrl-C on `make run`: the system ends in order, and make does not call that an error."""

from __future__ import annotations

import contextlib
import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CTRL_C = b"\x03"
CTRL_Z = b"\x1a"
# Stands where compose would stand, so that only make and the way to it are looked at.
COMMAND = f"""#!{sys.executable} -S
import signal, sys, time
received = []
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda number, _: received.append(signal.Signals(number).name))
print("up:", *sys.argv[1:], flush=True)
while not received:
    time.sleep(0.01)
print("down after", received[0], flush=True)
"""


@pytest.fixture
def make_run(tmp_path: Path) -> list[str]:
    """`make run` in an environment in which everything is said to be installed."""
    command = tmp_path / "bin" / "compose"
    command.parent.mkdir()
    command.write_text(COMMAND, "utf-8")
    command.chmod(0o755)
    for stamp in ("environment", "composer", "interfaces"):  # in the order of their dependencies
        path = tmp_path / "stamps" / stamp
        path.parent.mkdir(exist_ok=True)
        path.touch()
    return ["make", "run", f"VENV={tmp_path}", f"PYTHON={sys.executable}", "SYSTEM=some.yaml"]


class Terminal:
    """A command in a terminal of its own: the keys, the output, the end."""

    def __init__(self, command: list[str]) -> None:
        self.output = b""
        self.process, self._keys = pty.fork()
        if self.process == 0:
            os.chdir(ROOT)
            os.execvp(command[0], command)

    def wait_for(self, text: bytes) -> None:
        while text not in self.output:
            self.output += os.read(self._keys, 4096)

    def press(self, key: bytes) -> None:
        os.write(self._keys, key)

    def wait_for_stop(self) -> None:
        os.waitpid(self.process, os.WUNTRACED)

    def go_on(self) -> None:
        """Do what a shell's `fg` does, and wait until the system has the terminal again."""
        os.killpg(self.process, signal.SIGCONT)
        while os.tcgetpgrp(self._keys) == self.process:
            time.sleep(0.01)

    def end(self) -> int:
        """Read what is left and return the exit code."""
        with contextlib.suppress(OSError):  # a terminal that nobody has open any more
            while more := os.read(self._keys, 4096):
                self.output += more
        os.close(self._keys)
        return os.waitstatus_to_exitcode(os.waitpid(self.process, 0)[1])


@pytest.fixture
def terminal(make_run: list[str]) -> Iterator[Terminal]:
    terminal = Terminal(make_run)
    yield terminal
    with contextlib.suppress(ProcessLookupError):
        os.killpg(terminal.process, signal.SIGKILL)


def test_ctrl_c_in_a_terminal_ends_with_0_and_without_a_word_of_make(terminal: Terminal) -> None:
    terminal.wait_for(b"up: run some.yaml")
    terminal.press(CTRL_C)

    assert terminal.end() == 0
    assert b"down after SIGINT" in terminal.output
    assert b"make:" not in terminal.output


def test_a_stopped_system_goes_on_and_still_hears_ctrl_c(terminal: Terminal) -> None:
    terminal.wait_for(b"up:")
    terminal.press(CTRL_Z)
    terminal.wait_for_stop()
    terminal.go_on()
    terminal.press(CTRL_C)

    assert terminal.end() == 0
    assert b"down after SIGINT" in terminal.output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_to_everything_reaches_the_system_without_a_terminal(
    make_run: list[str], number: signal.Signals
) -> None:
    with subprocess.Popen(
        make_run,
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        while not process.stdout.readline().startswith("up:"):
            assert process.poll() is None
        os.killpg(process.pid, number)
        output = process.stdout.read()

    assert output == f"down after {number.name}\n"
