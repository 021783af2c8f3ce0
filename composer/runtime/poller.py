"""Waiting for what Linux can announce: readiness of entities, other threads, and a point in time.

Linux only, 64 bit: an eventfd per announcement, epoll over all of them, and a timerfd because
epoll itself counts in milliseconds.
"""

from __future__ import annotations

import ctypes
import math
import os
import select
import time
from collections.abc import Callable
from functools import partial

_LIBC = ctypes.CDLL(None, use_errno=True)
_CLOCK_MONOTONIC = 1
_TFD_NONBLOCK_CLOEXEC = os.O_NONBLOCK | os.O_CLOEXEC
_TFD_TIMER_ABSTIME = 1
_NANOSECONDS = 1_000_000_000
_AT_ONCE = 64  # what one call reports; the rest comes with the next


class _TimeSpecification(ctypes.Structure):
    """``struct itimerspec``: interval, then value, each as seconds and nanoseconds."""

    _fields_ = (
        ("interval_s", ctypes.c_long),
        ("interval_ns", ctypes.c_long),
        ("value_s", ctypes.c_long),
        ("value_ns", ctypes.c_long),
    )


class Poller:
    """Sleeps until a watched eventfd is written, :meth:`wake` is called, or time is up.

    ``watch``, ``forget`` and ``wake`` may be called from any thread.
    """

    def __init__(self) -> None:
        self._epoll = select.epoll()
        #: Returns what was written since the last time, as (fd, event mask), without waiting.
        #: Not a method: this is called for each message.
        self.ready: Callable[[], list[tuple[int, int]]] = partial(self._epoll.poll, 0, _AT_ONCE)
        self._wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._timer_fd = _LIBC.timerfd_create(_CLOCK_MONOTONIC, _TFD_NONBLOCK_CLOEXEC)
        if self._timer_fd < 0:
            raise OSError(ctypes.get_errno(), "timerfd_create failed")
        self._armed_for_s: float | None = None
        self._time = _TimeSpecification()
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

    def wait(self, until_s: float | None) -> list[tuple[int, int]]:
        """Wait until something is written or ``time.monotonic()`` reaches ``until_s``."""
        if until_s is None or until_s == math.inf:
            return self._epoll.poll(None, _AT_ONCE)
        if until_s <= time.monotonic():
            return self.ready()
        if until_s != self._armed_for_s:
            self._arm(until_s)
        return self._epoll.poll(None, _AT_ONCE)

    def __del__(self) -> None:
        # Not sooner: a late wake() must not write to a descriptor that is somebody else's by now.
        os.close(self._wake_fd)
        os.close(self._timer_fd)

    def _arm(self, until_s: float) -> None:
        self._armed_for_s = until_s
        nanoseconds = int(until_s * _NANOSECONDS) + 1
        self._time.value_s, self._time.value_ns = divmod(nanoseconds, _NANOSECONDS)
        arguments = (self._timer_fd, _TFD_TIMER_ABSTIME, ctypes.byref(self._time), None)
        if _LIBC.timerfd_settime(*arguments) != 0:
            raise OSError(ctypes.get_errno(), "timerfd_settime failed")
