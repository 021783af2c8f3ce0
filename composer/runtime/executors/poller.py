"""Waits for entities that become ready, for wake-ups from other threads and for points in time.

64-bit Linux only: an eventfd per group of entities, and epoll over all of them. Points in time use
two mechanisms, because programming a timer costs as much as several messages, above all on a
virtual machine:

- ``epoll_pwait2`` programs a timer for one wait. It is a single system call with no state to keep:
  between two ticks the processor has worked for others, and every step costs many times what it
  costs in a tight loop.
- A timerfd stays programmed: for a loop that was woken by something else and waits for the same
  time again.
"""

from __future__ import annotations

import ctypes
import errno
import os
import select
from collections.abc import Callable, Sequence
from functools import partial

from composer.runtime.clock import Clock, VirtualClock, Wakeup

#: The file descriptors that are ready, as (file descriptor, event mask).
Ready = Sequence[tuple[int, int]]

_LIBC = ctypes.CDLL(None)
_PR_SET_TIMERSLACK = 29  # of <sys/prctl.h>
_CLOCK_MONOTONIC = 1
_TFD_NONBLOCK_CLOEXEC = os.O_NONBLOCK | os.O_CLOEXEC
_TFD_TIMER_ABSTIME = 1
_NANOSECONDS = 1_000_000_000
_MAX_EVENTS = 64  # per call; the rest comes with the next
_EVENT_BYTES = 16  # of one epoll_event, at most
_NEVER_S = 1e9  # beyond the uptime of any machine, within the range of C's time_t


def _has_pwait2() -> bool:
    """Return whether ``epoll_pwait2`` is available, as it is since Linux 5.11.

    A container's seccomp filter may forbid it nevertheless.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "epoll_pwait2"):
        return False
    invalid_fd = -1
    libc.epoll_pwait2(invalid_fd, None, 1, None, None)
    return ctypes.get_errno() == errno.EBADF


HAS_PWAIT2 = _has_pwait2()


def use_precise_wakeups() -> None:
    """Make Linux wake the current thread on time instead of up to 50 us late.

    By default it groups timers that expire close together, unless the thread has real-time
    priority.
    """
    _LIBC.prctl(_PR_SET_TIMERSLACK, ctypes.c_ulong(1))


def _pointer(view: memoryview) -> object:
    """Return the address of the view's memory, as an argument for C."""
    return ctypes.byref(ctypes.c_char.from_buffer(view))


class Poller:
    """Waits until a registered eventfd is written, :meth:`wake` is called, or a time has come.

    ``register``, ``unregister`` and ``wake`` may be called from any thread.
    """

    def __init__(self, clock: Clock) -> None:
        self._monotonic = clock.monotonic
        self._epoll = select.epoll()
        #: Returns what is ready, without waiting. A partial, not a method: called per message.
        self.poll: Callable[[], Ready] = partial(self._epoll.poll, 0, _MAX_EVENTS)
        # Seconds and nanoseconds as C reads them: a timeout (timespec), a time (itimerspec).
        self._timeout = memoryview(bytearray(16)).cast("l")
        self._time = memoryview(bytearray(32)).cast("l")
        self._sleep: Callable[[], int] | None = None
        if HAS_PWAIT2:
            event = ctypes.create_string_buffer(_EVENT_BYTES)
            epoll_fd = self._epoll.fileno()
            timeout = _pointer(self._timeout)
            self._sleep = partial(_LIBC.epoll_pwait2, epoll_fd, event, 1, timeout, None)
        self._slept_until_s = self._programmed_for_s = 0.0
        self._wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._timer_fd = _LIBC.timerfd_create(_CLOCK_MONOTONIC, _TFD_NONBLOCK_CLOEXEC)
        if self._timer_fd < 0:
            raise OSError("timerfd_create failed")
        for fd in (self._wake_fd, self._timer_fd):
            # Edge-triggered: each write is a new edge, so the counter need not be read.
            self._epoll.register(fd, select.EPOLLIN | select.EPOLLET)

    def register(self, fd: int) -> None:
        """Report ``fd`` from now on while its counter is not zero."""
        self._epoll.register(fd, select.EPOLLIN)

    def unregister(self, fd: int) -> None:
        """Stop reporting ``fd``. Call it before the file is closed."""
        self._epoll.unregister(fd)

    def wake(self) -> None:
        """End the current or the next wait."""
        os.eventfd_write(self._wake_fd, 1)

    def wait(self, until_s: float) -> Ready:
        """Wait until something is ready or the clock reaches ``until_s``.

        It may return earlier.
        """
        if until_s > _NEVER_S:
            return self._epoll.poll(None, _MAX_EVENTS)
        left_s = until_s - self._monotonic()
        if left_s <= 0.0:
            return self.poll()
        if until_s != self._programmed_for_s:
            if self._sleep is not None and until_s != self._slept_until_s:
                self._slept_until_s = until_s
                self._timeout[0] = seconds = int(left_s)
                self._timeout[1] = int((left_s - seconds) * _NANOSECONDS)
                return self.poll() if self._sleep() else ()
            self._program(until_s)
        return self._epoll.poll(None, _MAX_EVENTS)

    def __del__(self) -> None:
        # Not earlier: a late wake() must not write to a file descriptor that was reused.
        os.close(self._wake_fd)
        os.close(self._timer_fd)

    def _program(self, until_s: float) -> None:
        self._programmed_for_s = until_s
        nanoseconds = int(until_s * _NANOSECONDS) + 1
        self._time[2], self._time[3] = divmod(nanoseconds, _NANOSECONDS)  # after the interval
        if _LIBC.timerfd_settime(self._timer_fd, _TFD_TIMER_ABSTIME, _pointer(self._time), None):
            raise OSError("timerfd_settime failed")


class VirtualPoller:
    """Waits for wake-ups and points in virtual time.

    No entity becomes ready in an isolated system, because all messages stay in the process. In
    others, entities are ready at any time, as nodes in other processes like.
    """

    def __init__(self, clock: VirtualClock) -> None:
        self._wakeup = Wakeup(clock)
        self.wake = self._wakeup.wake
        self._epoll = None if clock.is_isolated else select.epoll()

    def poll(self) -> Ready:
        """Return what is ready."""
        return () if self._epoll is None else self._epoll.poll(0, _MAX_EVENTS)

    def register(self, fd: int) -> None:
        """Report ``fd`` from now on while its counter is not zero."""
        if self._epoll is not None:
            self._epoll.register(fd, select.EPOLLIN)

    def unregister(self, fd: int) -> None:
        """Stop reporting ``fd``. Call it before the file is closed."""
        if self._epoll is not None:
            self._epoll.unregister(fd)

    def wait(self, until_s: float) -> Ready:
        """Wait until something is ready or the clock reaches ``until_s``; :meth:`wake` ends it."""
        self._wakeup.wait(until_s, lambda: bool(self.poll()))
        return self.poll()


def poller_for(clock: Clock) -> Poller | VirtualPoller:
    """Return a poller that waits by ``clock``."""
    return VirtualPoller(clock) if isinstance(clock, VirtualClock) else Poller(clock)
