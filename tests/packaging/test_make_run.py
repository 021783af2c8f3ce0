"""Ctrl-C in `make run`: the system shuts down in order, and make does not report an error."""

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
# Replaces compose.
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
    """The command `make run` with an environment in which everything is marked as installed."""
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
    """A command in a pseudo-terminal: its input, output and exit code."""

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

    def stop_and_resume(self) -> None:
        """Press Ctrl-Z, and resume it like `fg`, until the system has the terminal again."""
        self.press(CTRL_Z)
        os.waitpid(self.process, os.WUNTRACED)
        os.killpg(self.process, signal.SIGCONT)
        while os.tcgetpgrp(self._keys) == self.process:
            time.sleep(0.01)

    def wait(self) -> int:
        """Read the remaining output and return the exit code."""
        with contextlib.suppress(OSError):  # raised when the terminal is closed
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


@pytest.mark.parametrize("is_stopped_before", [False, True])
def test_ctrl_c_in_a_terminal_exits_with_0_without_output_of_make(
    terminal: Terminal, is_stopped_before: bool
) -> None:
    terminal.wait_for(b"up: run some.yaml")
    if is_stopped_before:
        terminal.stop_and_resume()
    terminal.press(CTRL_C)
    assert terminal.wait() == 0
    assert b"down after SIGINT" in terminal.output
    assert is_stopped_before or b"make:" not in terminal.output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_to_the_process_group_reaches_the_system_without_a_terminal(
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
