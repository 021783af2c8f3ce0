"""Runs a command for as long as another program asks for it: here, or at the end of an ssh channel.

It is a program of its own, ``python -m composer.client.hosts.guard SILENCE_S COMMAND...``. The
other program writes bytes to its standard input occasionally. When that closes, or says nothing for
``SILENCE_S`` seconds, the command is ended in order: SIGINT, SIGTERM, SIGKILL, each to its process
group. So the command ends if the other program ends or is killed, if its computer is switched off,
and if the network between them fails for that long, but not if it fails for a shorter time.

The exit code is the command's; 128 + N if a signal has ended it.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import signal
import subprocess
import sys
import time
from types import FrameType

#: Longer than --grace of compose run, by which it ends in any case.
_TERMINATE_AFTER_S = 12.0
_KILL_AFTER_S = 3.0
_SIGNAL_EXIT = 128
_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None)


class Guard:
    """One command, in a session of its own, and what ends it."""

    def __init__(self, command: list[str], silence_s: float) -> None:
        self._silence_s = silence_s
        self._is_asked = True
        self._received_s = time.monotonic()
        self._due: list[tuple[float, signal.Signals]] = []  # the signals to send, with their times
        self._wakeup, wakeup = os.pipe()
        for end in (self._wakeup, wakeup):
            os.set_blocking(end, False)
        signal.set_wakeup_fd(wakeup, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, _ignore)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            signal.signal(number, lambda *_: self._end(again=True))
        self._process = subprocess.Popen(  # noqa: S603 - what this program is for
            command,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
            preexec_fn=_end_with_guard,  # noqa: PLW1509 - there is one thread
        )

    def run(self) -> int:
        """Wait for the end of the command; return the exit code."""
        while self._process.poll() is None:
            self._wait()
            if self._is_asked and time.monotonic() - self._received_s > self._silence_s:
                self._end()
            while self._due and self._due[0][0] <= time.monotonic():
                self._send(self._due.pop(0)[1])
        self._send(signal.SIGKILL)  # what it has left behind in its group
        code = self._process.returncode
        return code if code >= 0 else _SIGNAL_EXIT - code

    def _wait(self) -> None:
        """Wait for a byte, a signal or the next limit."""
        sources = [self._wakeup, *([sys.stdin.fileno()] if self._is_asked else [])]
        limits = [due_s for due_s, _ in self._due[:1]]
        limits += [self._received_s + self._silence_s] if self._is_asked else []
        left_s = max(0.0, min(limits) - time.monotonic()) if limits else None
        ready, _, _ = select.select(sources, [], [], left_s)
        if self._wakeup in ready:
            with contextlib.suppress(BlockingIOError):
                os.read(self._wakeup, 4096)
        if sys.stdin.fileno() in ready:
            if os.read(sys.stdin.fileno(), 4096):
                self._received_s = time.monotonic()
            else:
                self._end()

    def _end(self, *, again: bool = False) -> None:
        """End the command in order; ``again``, it ends at once: compose run takes no time then."""
        if again and not self._is_asked:
            self._send(signal.SIGINT)
        if self._is_asked:
            self._is_asked = False
            self._send(signal.SIGINT)
            now_s = time.monotonic()
            terminate_s = now_s + _TERMINATE_AFTER_S
            self._due = [(terminate_s, signal.SIGTERM)]
            self._due += [(terminate_s + _KILL_AFTER_S, signal.SIGKILL)]

    def _send(self, number: signal.Signals) -> None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, number)


def _ignore(number: int, frame: FrameType | None) -> None:
    """Do nothing: the signal has interrupted the wait."""


def _end_with_guard() -> None:
    """In the new process: end in order if the guard is killed."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, ctypes.c_ulong(signal.SIGTERM))


if __name__ == "__main__":
    sys.exit(Guard(sys.argv[2:], float(sys.argv[1])).run())
