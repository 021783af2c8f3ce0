"""Signals as requests to stop, a pipe that wakes the main loop, messages to a service manager."""

from __future__ import annotations

import math
import os
import select
import signal
import socket
import threading
from collections.abc import Callable, Iterator, MutableMapping
from contextlib import contextmanager, suppress
from types import FrameType

from composer.runtime.clock import Clock, VirtualClock, Wakeup
from composer.runtime.process.watchdog import STOP_SIGNALS

_MILLISECONDS = 1000
_LONGEST_MS = 2**31 - 1  # the longest timeout of poll(2): 24 days
_READ_BYTES = 65536
_VARIABLE = "NOTIFY_SOCKET"
READY, STOPPING, ALIVE = "READY=1", "STOPPING=1", "WATCHDOG=1"


class WakeupSocket:
    """Wakes the current wait, or the next one.

    A lock does not work here: a signal that arrives just before the wait for a lock does not end
    it, and Python never runs the handler. A byte in a socket is still there for the wait.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._reader, self._writer = socket.socketpair()
        for end in (self._reader, self._writer):
            end.setblocking(False)
        #: Any byte written here wakes, also by ``signal.set_wakeup_fd``.
        self.fd = self._writer.fileno()
        self._poll = select.poll()
        self._poll.register(self._reader, select.POLLIN)

    @property
    def read_fd(self) -> int:
        """The socket from which the wait reads."""
        return self._reader.fileno()

    def wake(self) -> None:
        """End the current or the next wait, from any thread or a signal handler."""
        with suppress(BlockingIOError):  # full: the next wait ends anyway
            os.write(self.fd, b"\0")

    def clear(self) -> None:
        """Forget the wake-ups so far; the numbers of signals are among them."""
        with suppress(BlockingIOError):
            self._reader.recv(_READ_BYTES)

    def wait(self, until_s: float = math.inf) -> bool:
        """Sleep until a wake-up; return False if ``until_s`` (monotonic) comes first."""
        while not self._poll.poll(self._milliseconds_until(until_s)):
            if self._clock.monotonic() >= until_s:
                return False
        self.clear()
        return True

    def __del__(self) -> None:
        # Not sooner: a late wake-up must not write to a descriptor that was reused.
        self._reader.close()
        self._writer.close()

    def _milliseconds_until(self, end_s: float) -> int:
        left_ms = max(0.0, end_s - self._clock.monotonic()) * _MILLISECONDS
        return math.ceil(min(left_ms, _LONGEST_MS))


def wakeup_for(clock: Clock) -> WakeupSocket | Wakeup:
    """Return what wakes a thread that waits by ``clock``."""
    return Wakeup(clock) if isinstance(clock, VirtualClock) else WakeupSocket(clock)


@contextmanager
def stop_signals(
    stop: Callable[[str], None], wakeup: WakeupSocket | Wakeup, *, ends_process: bool
) -> Iterator[None]:
    """Call ``stop(name of the signal)`` for each signal, on the main thread.

    Python calls signal handlers between two instructions of the main thread, which therefore must
    sleep only in ``wakeup.wait()``. ``stop`` must wake that, and must not acquire a lock that the
    main thread may hold.

    If the process ends after this (``ends_process``), signals are ignored from then on, so that
    another Ctrl-C does not kill the process before it has reported the outcome.

    Python installs signal handlers on the main thread only; on other threads this does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(number: int, _: FrameType | None) -> None:
        if isinstance(wakeup, WakeupSocket):
            wakeup.clear()  # the watchdog sees that the signal is handled
        stop(signal.Signals(number).name)

    before = {number: signal.signal(number, handle) for number in STOP_SIGNALS}
    fd_before = signal.set_wakeup_fd(wakeup.fd, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(fd_before)
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if ends_process else handler)


class ServiceManager:
    """Sends messages, from any thread."""

    def __init__(self, environment: MutableMapping[str, str] = os.environ) -> None:
        name = environment.pop(_VARIABLE, "")
        # Those that begin with '@' are in Linux' abstract namespace.
        self._address = f"\0{name[1:]}" if name.startswith("@") else name

    def send(self, *messages: str) -> None:
        """Send messages such as READY; if the service manager is gone, they are lost."""
        if not self._address:
            return
        with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as datagrams:
            datagrams.setblocking(False)
            datagrams.sendto("\n".join(messages).encode(), self._address)
