"""Waiting for what Linux can announce: readiness of entities, other threads, and a point in time.

Linux only, 64 bit: an eventfd per announcement and epoll over all of them. For a time there are two
ways, since programming a timer costs as much as a few messages, on a virtual machine above all:

- ``epoll_pwait2`` programs one for that wait: one system call, and nothing to take note of. Between
  two ticks the processor worked for others, and then each step costs many times what it costs in a
  loop.
- a timerfd stays programmed: for who was woken by something else and waits for the same time again.
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
_CLOCK_MONOTONIC = 1
_TFD_NONBLOCK_CLOEXEC = os.O_NONBLOCK | os.O_CLOEXEC
_TFD_TIMER_ABSTIME = 1
_NANOSECONDS = 1_000_000_000
_AT_ONCE = 64  # what one call reports; the rest comes with the next
_EVENT_BYTES = 16  # of one epoll_event, at most
_NEVER_S = 1e9  # the machine will not run for so long, and a time of C has an end


def _has_pwait2() -> bool:
    """Say whether there is ``epoll_pwait2``, as there is since Linux 5.11.

    What keeps a container from system calls that it does not know may forbid it there, too.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "epoll_pwait2"):
        return False
    nobody = -1
    libc.epoll_pwait2(nobody, None, 1, None, None)
    return ctypes.get_errno() == errno.EBADF


_HAS_PWAIT2 = _has_pwait2()


def wake_in_time() -> None:
    """Have Linux wake the current thread when its time has come, and not some 50 us later.

    It puts times together that are near each other, unless the thread has real-time priority.
    """
    _LIBC.prctl(_PR_SET_TIMERSLACK, ctypes.c_ulong(1))


def _pointer(view: memoryview) -> object:
    """Return the address of the view's memory, as an argument for C."""
    return ctypes.byref(ctypes.c_char.from_buffer(view))


class Poller:
    """Sleeps until a watched eventfd is written, :meth:`wake` is called, or time is up.

    ``watch``, ``forget`` and ``wake`` may be called from any thread.
    """

    def __init__(self) -> None:
        self._epoll = select.epoll()
        #: Returns what was written since the last time, without waiting.
        #: Not a method: this is called for each message.
        self.ready: Callable[[], Announced] = partial(self._epoll.poll, 0, _AT_ONCE)
        # Seconds and nanoseconds, where C reads them: how long (timespec), until when (itimerspec).
        self._left = memoryview(bytearray(16)).cast("l")
        self._time = memoryview(bytearray(32)).cast("l")
        self._sleep: Callable[[], int] | None = None
        if _HAS_PWAIT2:
            event = ctypes.create_string_buffer(_EVENT_BYTES)
            epoll_fd = self._epoll.fileno()
            left = _pointer(self._left)
            self._sleep = partial(_LIBC.epoll_pwait2, epoll_fd, event, 1, left, None)
        self._slept_until_s = self._programmed_for_s = 0.0
        self._wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._timer_fd = _LIBC.timerfd_create(_CLOCK_MONOTONIC, _TFD_NONBLOCK_CLOEXEC)
        if self._timer_fd < 0:
            raise OSError("timerfd_create failed")
        for fd in (self._wake_fd, self._timer_fd):
            # Edge-triggered: each write is a new edge, so nobody needs to read the counter back.
            self._epoll.register(fd, select.EPOLLIN | select.EPOLLET)

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

        It may wait for less than that.
        """
        if until_s > _NEVER_S:
            return self._epoll.poll(None, _AT_ONCE)
        left_s = until_s - monotonic()
        if left_s <= 0.0:
            return self.ready()
        if until_s != self._programmed_for_s:
            if self._sleep is not None and until_s != self._slept_until_s:
                self._slept_until_s = until_s
                self._left[0] = seconds = int(left_s)
                self._left[1] = int((left_s - seconds) * _NANOSECONDS)
                return self.ready() if self._sleep() else ()
            self._program(until_s)
        return self._epoll.poll(None, _AT_ONCE)

    def __del__(self) -> None:
        # Not sooner: a late wake() must not write to a descriptor that is somebody else's by now.
        os.close(self._wake_fd)
        os.close(self._timer_fd)

    def _program(self, until_s: float) -> None:
        self._programmed_for_s = until_s
        nanoseconds = int(until_s * _NANOSECONDS) + 1
        self._time[2], self._time[3] = divmod(nanoseconds, _NANOSECONDS)  # after the interval
        if _LIBC.timerfd_settime(self._timer_fd, _TFD_TIMER_ABSTIME, _pointer(self._time), None):
            raise OSError("timerfd_settime failed")
