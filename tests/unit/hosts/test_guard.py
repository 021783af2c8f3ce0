"""The guard: its command runs for as long as something asks for it, and leaves nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PATIENCE_S = 20.0
#: Prints its process id and that of a child, and how it is ended.
COMMAND = """
import os, signal, subprocess, sys
child = subprocess.Popen(["sleep", "1000"])
try:
    print(os.getpid(), child.pid, flush=True)
    signal.pause()
except KeyboardInterrupt:
    print("interrupted", flush=True)
    sys.exit(7)
"""


@contextmanager
def guarded(silence_s: float, code: str = COMMAND) -> Iterator[subprocess.Popen[str]]:
    words = [sys.executable, "-P", "-m", "composer.hosts.guard", str(silence_s)]
    guard = subprocess.Popen(
        [*words, sys.executable, "-I", "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield guard
    finally:
        guard.kill()
        guard.communicate(timeout=PATIENCE_S)


def pids(guard: subprocess.Popen[str]) -> list[int]:
    assert guard.stdout is not None
    return [int(word) for word in guard.stdout.readline().split()]


def wait_for_end(found: list[int]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while any(is_alive(pid) for pid in found):
        assert time.monotonic() < end_s, "processes are left"
        time.sleep(0.01)  # poll: these are not children of this process


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


def test_the_end_of_the_input_ends_the_command_in_order() -> None:
    with guarded(60.0) as guard:
        found = pids(guard)
        output, _ = guard.communicate(timeout=PATIENCE_S)
        assert output == "interrupted\n"
        assert guard.returncode == 7
        wait_for_end(found)


def test_silence_ends_the_command_and_words_keep_it() -> None:
    with guarded(1.0) as guard:
        found = pids(guard)
        assert guard.stdin is not None
        spoken_until_s = time.monotonic() + 1.5
        while time.monotonic() < spoken_until_s:
            guard.stdin.write(".")
            guard.stdin.flush()
            time.sleep(0.1)  # the pace of the words
        assert is_alive(found[0])
        assert guard.wait(PATIENCE_S) == 7
        wait_for_end(found)


def test_nothing_is_left_by_a_killed_guard() -> None:
    with guarded(
        60.0, "import os, signal; print(os.getpid(), flush=True); signal.pause()"
    ) as guard:
        (command,) = pids(guard)
        os.kill(guard.pid, signal.SIGKILL)
        wait_for_end([command])


def test_the_exit_code_is_that_of_the_command() -> None:
    with guarded(60.0, "import sys; sys.exit(3)") as guard:
        assert guard.wait(PATIENCE_S) == 3
    with guarded(60.0, "import os; os.kill(os.getpid(), 9)") as guard:
        assert guard.wait(PATIENCE_S) == 128 + signal.SIGKILL
