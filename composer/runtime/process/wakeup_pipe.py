"""Sleeping until somebody rings: another thread, or a signal."""

from __future__ import annotations

import math
import os
import select
import time
from contextlib import suppress

_MILLISECONDS = 1000
_LONGEST_MS = 2**31 - 1  # more cannot be slept at once: 24 days
_MANY = 65536


class WakeupPipe:
    """A ring that comes before the wait ends it, too.

    Waiting on a lock does not do: a signal that comes just before the lock is waited for does not
    end the wait, and its handler, which Python runs between two instructions, never gets its turn.
    What Python writes to a file descriptor when the signal comes is still there to be read.
    """

    def __init__(self) -> None:
        #: Any byte written here rings; made for ``signal.set_wakeup_fd``, too.
        self._ear, self.fd = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._poll = select.poll()
        self._poll.register(self._ear, select.POLLIN)

    def ring(self) -> None:
        """End the current or the next wait, from any thread or a signal handler."""
        with suppress(BlockingIOError):  # full: it rings already
            os.write(self.fd, b"\0")

    def wait(self, until_s: float | None) -> bool:
        """Sleep until it rings; false when ``time.monotonic()`` reached ``until_s`` before."""
        end_s = math.inf if until_s is None else until_s
        while not self._poll.poll(_milliseconds_until(end_s)):
            if time.monotonic() >= end_s:
                return False
        os.read(self._ear, _MANY)
        return True

    def __del__(self) -> None:
        # Not sooner: a late ring must not be written to what is somebody else's by now.
        os.close(self._ear)
        os.close(self.fd)


def _milliseconds_until(end_s: float) -> int:
    left_ms = max(0.0, end_s - time.monotonic()) * _MILLISECONDS
    return math.ceil(min(left_ms, _LONGEST_MS))
