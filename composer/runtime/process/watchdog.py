"""A small process that ends a system whose C code keeps the interpreter's lock.

Python notes a signal without the lock and writes its number to the socket that wakes the main
loop. The watchdog looks at the same socket. A number that is still there after the time limit
means that no signal handler runs: a regular expression, for example, keeps the lock until it has
its result. Like the watchdog of systemd, this one sends SIGABRT, which prints the stacks, and
then SIGKILL. It runs this file as a program and imports only the standard library.
"""

from __future__ import annotations

import faulthandler
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

#: SIGQUIT would leave sockets and shared memory behind.
STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
#: A second signal ends the process after this time.
_URGENT_S = 1.0
_INTERVAL_S = 0.25
_STACKS_WITHIN_S = 0.5
_PACKET_BYTES = 65_536


@contextmanager
def signal_watchdog(wakeup_fd: int, limit_s: float) -> Iterator[None]:
    """End this process ``limit_s`` seconds after a signal that it cannot handle.

    ``wakeup_fd`` is the socket from which the main thread reads what ``signal.set_wakeup_fd``
    wrote.
    """
    faulthandler.enable(file=2)
    words = (__file__, str(wakeup_fd), str(os.getpid()), str(limit_s))
    watchdog = subprocess.Popen(  # noqa: S603 - this file
        [sys.executable, "-I", "-S", *words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        pass_fds=(wakeup_fd,),
        start_new_session=True,  # Ctrl-C is for the system
    )
    try:
        yield
    finally:
        watchdog.kill()
        watchdog.wait()


def _watch(wakeup: socket.socket, process: int, limit_s: float) -> None:
    """Return when the process has ended, or has been ended."""
    poll = select.poll()
    poll.register(wakeup, select.POLLIN)
    unread_since_s: float | None = None
    while os.getppid() == process:
        poll.poll()
        content = b"\0"
        with suppress(BlockingIOError):  # meanwhile, the main thread has read it
            content = wakeup.recv(_PACKET_BYTES, socket.MSG_PEEK)
        signals = [number for number in content if number in STOP_SIGNALS]
        now_s = time.monotonic()
        if not signals:
            unread_since_s = None
        elif unread_since_s is None:
            unread_since_s = now_s
        elif now_s - unread_since_s > (min(limit_s, _URGENT_S) if signals[1:] else limit_s):
            _end(process, signal.Signals(signals[0]).name)
            return
        time.sleep(_INTERVAL_S)


def _end(process: int, name: str) -> None:
    text = f"compose: {name} was not handled, as C code keeps the interpreter's lock; ending\n"
    with suppress(OSError):
        os.write(2, text.encode())
    for number in (signal.SIGABRT, signal.SIGKILL):
        with suppress(ProcessLookupError):
            os.kill(process, number)
        time.sleep(_STACKS_WITHIN_S)


if __name__ == "__main__":
    _watch(socket.socket(fileno=int(sys.argv[1])), int(sys.argv[2]), float(sys.argv[3]))
