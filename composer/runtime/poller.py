"""Waiting for what Linux can announce: readiness of entities, other threads, and a point in time.

Linux only, 64 bit: an eventfd per announcement and epoll over all of them. To wait for a time is
one system call that returns nothing: between two ticks of a timer the processor worked for others,
and then every step that is taken costs many times what it costs in a loop.
"""

from __future__ import annotations

import ctypes
import errno
import os
import select
from collections.abc import Callable, Sequence
from functools import partial
from time import monotonic

#: What was written to, as (file descriptor, event mask).
Announced = Sequence[tuple[int, int]]

_LIBC = ctypes.CDLL(None)
_PR_SET_TIMERSLACK = 29  # of <sys/prctl.h>
_NANOSECONDS = 1e9
_AT_ONCE = 64  # what one call reports; the rest comes with the next
_EVENT_BYTES = 16  # of one epoll_event, at most
_TIME_BYTES = 16  # of a timespec: seconds, nanoseconds
_NOBODY = -1
_NEVER_S = 1e9  # the machine will not run for so long, and a time of C has an end


def _counts_in_nanoseconds() -> bool:
    """Say whether there is ``epoll_pwait2``, as there is since Linux 5.11."""
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "epoll_pwait2"):
        return False
    libc.epoll_pwait2(_NOBODY, None, 1, None, None)
    return ctypes.get_errno() != errno.ENOSYS


_COUNTS_IN_NANOSECONDS = _counts_in_nanoseconds()


def wake_in_time() -> None:
    """Have Linux wake the current thread when its time has come, and not some 50 us later.

    It puts times together that are near each other, unless the thread has real-time priority.
    """
    _LIBC.prctl(_PR_SET_TIMERSLACK, ctypes.c_ulong(1))


class Poller:
    """Sleeps until a watched eventfd is written, :meth:`wake` is called, or time is up.

    ``watch``, ``forget`` and ``wake`` may be called from any thread.
    """

    def __init__(self) -> None:
        self._epoll = select.epoll()
        #: Returns what was written since the last time, without waiting.
        #: Not a method: this is called for each message.
        self.ready: Callable[[], Announced] = partial(self._epoll.poll, 0, _AT_ONCE)
        self._left = memoryview(bytearray(_TIME_BYTES)).cast("l")
        self._event = ctypes.create_string_buffer(_EVENT_BYTES)
        self._sleep: Callable[[], int] | None = None
        if _COUNTS_IN_NANOSECONDS:
            left = (ctypes.c_char * _TIME_BYTES).from_buffer(self._left)
            epoll_fd = self._epoll.fileno()
            self._sleep = partial(_LIBC.epoll_pwait2, epoll_fd, self._event, 1, left, None)
        self._wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        # Edge-triggered: each write is a new edge, so nobody needs to read the counter back.
        self._epoll.register(self._wake_fd, select.EPOLLIN | select.EPOLLET)

    def watch(self, fd: int) -> None:
        """Report ``fd`` from now on, as long as its counter is not read back."""
        self._epoll.register(fd, select.EPOLLIN)

    def forget(self, fd: int) -> None:
        """Do not report ``fd`` any more. To be called before it is closed."""
        self._epoll.unregister(fd)

    def wake(self) -> None:
        """End the current or the next wait."""
        os.eventfd_write(self._wake_fd, 1)

    def wait(self, until_s: float) -> Announced:
        """Wait until something is written or ``time.monotonic()`` reaches ``until_s``.

        It may wait for less than that. Where Linux is older than 5.11, up to a millisecond longer.
        """
        if until_s > _NEVER_S:
            return self._epoll.poll(None, _AT_ONCE)
        left_s = until_s - monotonic()
        if left_s <= 0.0:
            return self.ready()
        if self._sleep is None:
            return self._epoll.poll(left_s, _AT_ONCE)
        self._left[0] = seconds = int(left_s)
        self._left[1] = int((left_s - seconds) * _NANOSECONDS)
        if self._sleep() == 0:
            return ()
        return self.ready()

    def __del__(self) -> None:
        # Not sooner: a late wake() must not write to a descriptor that is somebody else's by now.
        os.close(self._wake_fd)
