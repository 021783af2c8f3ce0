"""The guard: its command runs for as long as something asks for it, and leaves nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from tests.unit.support.waiting import PATIENCE_S, is_alive, wait_until

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
    words = [sys.executable, "-P", "-m", "composer.client.hosts.guard", str(silence_s)]
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
    wait_until(lambda: not any(map(is_alive, found)), "the end of all")


def test_the_end_of_the_input_ends_the_command_in_order() -> None:
    with guarded(60.0) as guard:
        found = pids(guard)
        output, _ = guard.communicate(timeout=PATIENCE_S)
        assert output == "interrupted\n"
        assert guard.returncode == 7
        wait_for_end(found)


class Speaker:
    """Writes words to a guard, on a thread, and knows the longest pause between two."""

    def __init__(self, guard: subprocess.Popen[str]) -> None:
        self.longest_pause_s = 0.0
        self._guard = guard
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._speak, daemon=True)

    def __enter__(self) -> Speaker:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over.set()
        self._thread.join()

    def _speak(self) -> None:
        assert self._guard.stdin is not None
        spoken_s = time.monotonic()
        while not self._is_over.wait(0.1):
            with suppress(BrokenPipeError):  # it has ended
                self._guard.stdin.write(".")
                self._guard.stdin.flush()
            now_s = time.monotonic()
            self.longest_pause_s = max(self.longest_pause_s, now_s - spoken_s)
            spoken_s = now_s


def test_silence_ends_the_command_and_words_keep_it() -> None:
    while True:  # again if a busy machine has made the words come too late
        with guarded(1.0) as guard:
            with Speaker(guard) as speaker:
                assert guard.stdout is not None
                line = guard.stdout.readline()
                over_s = time.monotonic() + 1.5
                while time.monotonic() < over_s:
                    time.sleep(0.1)  # longer than the silence that is allowed
                found = [int(word) for word in line.split() if word.isdigit()]
                was_alive = len(found) == 2 and is_alive(found[0])
            if speaker.longest_pause_s < 0.9:
                assert was_alive
                assert guard.wait(PATIENCE_S) == 7
                wait_for_end(found)
                return


def test_nothing_is_left_by_a_killed_guard() -> None:
    code = "import os, signal; print(os.getpid(), flush=True); signal.pause()"
    with guarded(60.0, code) as guard:
        (command,) = pids(guard)
        os.kill(guard.pid, signal.SIGKILL)
        wait_for_end([command])


def test_the_exit_code_is_that_of_the_command() -> None:
    with guarded(60.0, "import sys; sys.exit(3)") as guard:
        assert guard.wait(PATIENCE_S) == 3
    with guarded(60.0, "import os; os.kill(os.getpid(), 9)") as guard:
        assert guard.wait(PATIENCE_S) == 128 + signal.SIGKILL
