"""A small process that ends a system whose C code keeps the interpreter's lock.

Python notes a signal without the lock and writes its number to the socket that wakes the main
loop. The signal handler reads the socket, and the watchdog polls it. A number that is still
there after the time limit means that no signal handler runs: a regular expression, for example,
keeps the lock until it has its result. Like the watchdog of systemd, this one sends SIGABRT, which
prints the stacks, and then SIGKILL. It runs this file as a program and imports only the standard
library.

Time in which the system cannot run does not count: while a debugger or SIGSTOP stops it, while the
computer sleeps, and, after a second signal, while other programs use all processors.
"""

from __future__ import annotations

import faulthandler
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

#: SIGQUIT would leave sockets and shared memory behind.
STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
#: A second signal ends the process after this time.
_URGENT_S = 1.0
#: Signals within this time are one request: tools that forward signals send one along with the
#: terminal's, and when a parent ends, Linux sends PR_SET_PDEATHSIG for each of its threads.
SAME_REQUEST_S = 0.1
_INTERVAL_S = 0.25
_STACKS_WITHIN_S = 2.0
_PACKET_BYTES = 65_536
_STOPPED = b"Tt"
_ThreadTimes = dict[str, tuple[float, float]]


@contextmanager
def signal_watchdog(wakeup_fd: int, limit_s: float) -> Iterator[None]:
    """End this process ``limit_s`` seconds after a signal that it cannot handle.

    ``wakeup_fd`` is the socket from which the main thread reads what ``signal.set_wakeup_fd``
    wrote.
    """
    faulthandler.enable(file=2)
    watchdog = _Watchdog(wakeup_fd, limit_s)
    try:
        yield
    finally:
        watchdog.close()


class _Watchdog:
    """The small process, which is started again if something kills it."""

    def __init__(self, wakeup_fd: int, limit_s: float) -> None:
        self._wakeup_fd = wakeup_fd
        self._limit_s = limit_s
        self._changing = threading.Lock()
        self._is_closed = False
        self._process = self._started()
        threading.Thread(target=self._keep_running, name="watchdog", daemon=True).start()

    def close(self) -> None:
        """End it."""
        with self._changing:
            self._is_closed = True
        self._process.kill()
        self._process.wait()

    def _started(self) -> subprocess.Popen[bytes]:
        words = (__file__, str(self._wakeup_fd), str(os.getpid()), str(self._limit_s))
        return subprocess.Popen(  # noqa: S603 - this file
            [sys.executable, "-I", "-S", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=(self._wakeup_fd,),
            start_new_session=True,  # Ctrl-C is for the system
        )

    def _keep_running(self) -> None:
        """Start it again once a signal has ended it; where it cannot run, do without it."""
        with suppress(OSError):  # no process can be started
            while self._process.wait() < 0:
                time.sleep(_INTERVAL_S)
                with self._changing:
                    if self._is_closed:
                        return
                    self._process = self._started()


def _watch(wakeup: socket.socket, process: int, limit_s: float) -> None:
    """Return when the process has ended, or has been ended."""
    descriptor = os.pidfd_open(process)  # the number may be reused once the process has ended
    poll = select.poll()
    poll.register(wakeup, select.POLLIN)
    poll.register(descriptor, select.POLLIN)
    while os.getppid() == process:
        late_s = _late_s()
        poll.poll()
        if not _unread(wakeup):
            # It was woken by something else. Until it reads that, poll returns at once.
            time.sleep(SAME_REQUEST_S / 2)
            continue
        time.sleep(SAME_REQUEST_S)  # signals that come within this time are one request
        # While this process had no processor, a second request may have arrived.
        is_late = _late_s() - late_s > SAME_REQUEST_S / 2
        number = _unhandled(wakeup, process, limit_s, 1 if is_late else len(_unread(wakeup)))
        if number is not None:
            _end(descriptor, signal.Signals(number).name)
            return
        time.sleep(_INTERVAL_S)


def _late_s() -> float:
    """Return how long this process has waited for a processor so far."""
    return sum(late_s for _, late_s in _thread_times_s(os.getpid()).values())


def _unhandled(wakeup: socket.socket, process: int, limit_s: float, first: int) -> int | None:
    """Return the signal that is not handled within the limit; None if there is none any more.

    The first request consists of ``first`` signals; more of them are a second one.
    """
    signals = _unread(wakeup)
    waited_s = ran_s = 0.0
    seen_s, times_s = time.monotonic(), _thread_times_s(process)
    while signals and not _is_stopped(process):
        time.sleep(_INTERVAL_S)
        now_s, now_times_s = time.monotonic(), _thread_times_s(process)
        passed_s = min(now_s - seen_s, 2 * _INTERVAL_S)  # the computer may have slept
        waited_s += passed_s
        ran_s += _progress_s(passed_s, times_s, now_times_s)
        seen_s, times_s = now_s, now_times_s
        signals = _unread(wakeup)
        is_urgent = len(signals) > first and ran_s > _URGENT_S
        if signals and (waited_s > limit_s or is_urgent):
            return signals[0]
    return None


def _progress_s(passed_s: float, before: _ThreadTimes, after: _ThreadTimes) -> float:
    """Return the time in which no thread waited for a processor, or a thread ran: the longer one.

    While one thread runs for a second, others that run Python have a second as well, or C code
    keeps the lock.
    """
    changes = [
        (ran_s - before[task][0], late_s - before[task][1])
        for task, (ran_s, late_s) in after.items()
        if task in before
    ]
    ran_s = max((ran_s for ran_s, _ in changes), default=0.0)
    late_s = max((late_s for _, late_s in changes), default=0.0)
    return max(ran_s, passed_s - late_s)


def _unread(wakeup: socket.socket) -> list[int]:
    """Return the numbers of the signals that no handler has read."""
    try:
        content = wakeup.recv(_PACKET_BYTES, socket.MSG_PEEK)
    except BlockingIOError:
        return []
    return [number for number in content if number in STOP_SIGNALS]


def _is_stopped(process: int) -> bool:
    content = _read(f"/proc/{process}/stat")
    return content.rpartition(b") ")[2][:1] in _STOPPED


def _thread_times_s(process: int) -> _ThreadTimes:
    """Return how long each thread ran, and how long it was ready to run and had no processor."""
    times_s = {}
    with suppress(OSError):
        for task in os.scandir(f"/proc/{process}/task"):
            words = _read(f"{task.path}/schedstat").split()
            if words:
                times_s[task.name] = int(words[0]) / 1e9, int(words[1]) / 1e9
    return times_s


def _read(path: str) -> bytes:
    """Return a short file; nothing if it cannot be read, as of a thread that has ended."""
    with suppress(OSError), open(path, "rb") as file:  # noqa: PTH123 - pathlib is slow to import
        return file.read()
    return b""


def _end(descriptor: int, name: str) -> None:
    text = f"compose: {name} was not handled, as C code keeps the interpreter's lock; ending\n"
    with suppress(OSError):
        os.write(2, text.encode())
    for number in (signal.SIGABRT, signal.SIGKILL):
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(descriptor, number)
        select.select([descriptor], [], [], _STACKS_WITHIN_S)


if __name__ == "__main__":
    with suppress(OSError):  # a kernel without pidfd_open, or a container that forbids it
        _watch(socket.socket(fileno=int(sys.argv[1])), int(sys.argv[2]), float(sys.argv[3]))
