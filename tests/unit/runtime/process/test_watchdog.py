"""The watchdog ends no process that handles its signals as soon as it can run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from composer.runtime.process.watchdog import signal_watchdog
from tests.unit.support.waiting import wait_until

IN_ORDER = 7
GRACE_S = 3.0
#: Signals that come later than this do not arrive as they are meant to: this computer is busy.
LATE_S = 0.05
#: Python code on the main thread, which handles signals and does not wait for them.
BUSY = """
print("holding", flush=True)
end_s = time.monotonic() + 2.5
while time.monotonic() < end_s:
    pass
"""
#: C code on another thread, which keeps the interpreter's lock.
HOLDING = """
library = ctypes.PyDLL(None)
library.write(1, b"holding\\n", 8)
library.usleep(2_000_000)
"""
PROGRAM = """
import ctypes, os, sys, threading, time
from composer.runtime.clock import COMPUTER
from composer.runtime.process.signals import WakeupSocket, stop_signals
from composer.runtime.process.watchdog import signal_watchdog

wakeup, reasons = WakeupSocket(COMPUTER), []

def stop(reason):
    reasons.append(reason)
    wakeup.wake()

def hold():
    exec(sys.argv[2])

with stop_signals(stop, wakeup, ends_process=True), signal_watchdog(wakeup.read_fd, 3.0):
    if sys.argv[1] == "main":
        hold()
    else:
        threading.Thread(target=hold).start()
    while not reasons:
        wakeup.wait()
os._exit(7)
"""


@pytest.mark.parametrize(
    ("thread", "code", "steps"),
    [
        ("main", BUSY, ((signal.SIGINT, 0.5), (signal.SIGTERM, 0.0))),
        (
            *("other", HOLDING),
            ((signal.SIGINT, 0.1), (signal.SIGSTOP, GRACE_S + 1.0), (signal.SIGCONT, 0.0)),
        ),
        ("other", HOLDING, ((signal.SIGINT, 0.01), (signal.SIGTERM, 0.0))),
    ],
    ids=["python", "stopped", "forwarded"],
)
def test_a_process_that_ends_in_order(
    thread: str, code: str, steps: tuple[tuple[int, float], ...]
) -> None:
    ended, late_s = _ended_by(thread, code, steps)
    while ended != (IN_ORDER, "") and late_s > LATE_S:
        ended, late_s = _ended_by(thread, code, steps)
    assert ended == (IN_ORDER, "")


def _ended_by(
    thread: str, code: str, steps: tuple[tuple[int, float], ...]
) -> tuple[tuple[int, str], float]:
    """Return how a process ends after these signals, and how much later they were sent."""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, thread, code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        begun_s = time.monotonic()
        for number, pause_s in steps:
            process.send_signal(number)
            time.sleep(pause_s)  # the times of the signals are what is tested
        late_s = time.monotonic() - begun_s - sum(pause_s for _, pause_s in steps)
        _, errors = process.communicate(timeout=60.0)
    return (process.returncode, errors), late_s


def _children(process: int) -> list[int]:
    files = Path(f"/proc/{process}/task").glob("*/children")
    return [int(number) for file in files for number in file.read_text(encoding="ascii").split()]


def test_a_watchdog_that_is_killed_is_started_again() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "other", 'print("holding", flush=True)'],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        [first] = _children(process.pid)
        os.kill(first, signal.SIGKILL)
        wait_until(lambda: _children(process.pid) not in ([], [first]), "another watchdog")
        [second] = _children(process.pid)
        process.send_signal(signal.SIGINT)
        assert process.wait(60.0) == IN_ORDER
    assert not Path(f"/proc/{second}").exists()


def test_a_watchdog_that_cannot_run_is_not_started_again(capfd: pytest.CaptureFixture[str]) -> None:
    with Path(os.devnull).open("rb") as no_socket, signal_watchdog(no_socket.fileno(), GRACE_S):
        [keeper] = (thread for thread in threading.enumerate() if thread.name == "watchdog")
        keeper.join(60.0)
        assert not keeper.is_alive()
    assert capfd.readouterr() == ("", "")
