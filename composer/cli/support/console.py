"""Console output that never blocks the program: a bounded queue and a thread for each stream.

Output stops when a terminal is paused (Ctrl-S), a pager waits for a key, or the collector of a log
hangs. See docs/decisions/0043-console-output.md.
"""

from __future__ import annotations

import fcntl
import os
import select
import stat
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import TextIO

from composer.cli.support.streams import WrappedStream

#: Text that may wait; beyond that, the oldest is dropped.
_MAX_WAITING_CHARACTERS = 1_048_576
#: One write. If all threads are busy, this thread gets the GIL every 5 ms: with writes of 4 KiB, it
#: would drop lines that could be written.
_WRITE_CHARACTERS = 65_536
#: One write at the end, when the program waits for progress.
_LAST_WRITE_CHARACTERS = 4096
#: At the end, waiting text is given up if none of it is written for this time ...
_STALLED_S = 0.25
#: ... and in any case after this time.
_LAST_WRITE_S = 3.0


class OutputQueue:
    """Writes texts to a file descriptor, in order, on a thread of its own.

    If texts were dropped, a line with their number of lines follows when output is possible again.
    A closed pipe drops everything without an error.
    """

    def __init__(self, fd: int, max_waiting: int = _MAX_WAITING_CHARACTERS) -> None:
        """Write to a duplicate of ``fd``; let ``max_waiting`` characters wait."""
        self._fd = os.dup(fd)
        self._writable = select.poll()
        self._writable.register(self._fd, select.POLLOUT)
        self._max_waiting = max_waiting
        # Reentrant: garbage collection may run a finalizer that prints, at any allocation.
        self._lock = threading.RLock()
        self._texts: deque[str] = deque()
        self._waiting = 0
        self._dropped_lines = 0
        self._written_bytes = 0
        self._is_closing = False
        self._is_broken = False
        self._is_idle = False
        self._wakeup = threading.Lock()  # a binary semaphore: the thread sleeps on it
        self._wakeup.acquire()
        self._thread = threading.Thread(target=self._run, name="console", daemon=True)
        self._thread.start()

    def put(self, text: str) -> None:
        """Write ``text`` soon, from any thread. Does not block, and raises nothing."""
        with self._lock:
            self._texts.append(text)
            self._waiting += len(text)
            while self._waiting > self._max_waiting and len(self._texts) > 1:
                oldest = self._texts.popleft()
                self._waiting -= len(oldest)
                self._dropped_lines += oldest.count("\n")
            if self._is_idle:
                self._wake()

    def close(self) -> None:
        """Write what waits, as long as the other side reads, and end the thread."""
        with self._lock:
            self._is_closing = True
            if self._is_idle:
                self._wake()
        for _ in range(round(_LAST_WRITE_S / _STALLED_S)):
            before = self._written_bytes
            self._thread.join(_STALLED_S)
            if not self._thread.is_alive() or self._written_bytes == before:
                break

    def _wake(self) -> None:
        self._is_idle = False
        self._wakeup.release()

    def _run(self) -> None:
        while True:
            text = self._take()
            if text:
                self._write(text.encode(errors="backslashreplace"))
            elif self._is_closing:
                os.close(self._fd)
                return
            else:
                self._wakeup.acquire()

    def _take(self) -> str:
        """Remove and return the next texts; if there are none, become idle."""
        with self._lock:
            taken: list[str] = []
            length = 0
            if self._dropped_lines and self._texts:
                note = f"... {self._dropped_lines} lines dropped: the output was blocked\n"
                taken.append(note)
                self._dropped_lines = 0
            limit = _LAST_WRITE_CHARACTERS if self._is_closing else _WRITE_CHARACTERS
            while self._texts and length < limit:
                taken.append(self._texts.popleft())
                length += len(taken[-1])
            self._waiting -= length
            self._is_idle = not taken and not self._is_closing
        return "".join(taken)

    def _write(self, data: bytes) -> None:
        while data and not self._is_broken:
            try:
                count = os.write(self._fd, data)
            except BlockingIOError:  # a socket, see _do_not_block_c_code
                self._writable.poll()
            except BrokenPipeError:
                self._is_broken = True
            except OSError:  # such as a full disk
                with self._lock:
                    self._dropped_lines += data.count(b"\n")
                return
            else:
                self._written_bytes += count
                data = data[count:]


class QueuedStream(WrappedStream):
    """A text stream whose output goes line by line through an :class:`OutputQueue`."""

    def __init__(self, stream: TextIO, queue: OutputQueue) -> None:
        super().__init__(stream)
        self._queue = queue
        self._line: deque[str] = deque()  # the parts of a line without its end

    def write(self, text: str) -> int:
        """Write ``text`` soon after it ends a line, or after :meth:`flush`."""
        if text.endswith("\n") and not self._line:
            self._queue.put(text)
        else:
            self._line.append(text)
            if "\n" in text:
                self.flush()
        return len(text)

    def flush(self) -> None:
        """Write an incomplete line soon."""
        parts: list[str] = []
        with suppress(IndexError):  # another thread may flush too
            while True:
                parts.append(self._line.popleft())
        if parts:
            self._queue.put("".join(parts))


@contextmanager
def queued_output() -> Iterator[None]:
    """Within the block, do not let output to stdout or stderr wait until it can be written.

    At the end, what waits is written as far as possible.
    """
    before = sys.stdout, sys.stderr
    queues: list[OutputQueue] = []
    sockets: list[int] = []
    try:
        sys.stdout, sys.stderr = _queued(*before, queues)
        sockets += _do_not_block_c_code()
        os.register_at_fork(after_in_child=partial(_restore, *before))  # it has no thread
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        _restore(*before)
        for queue in queues:
            queue.close()
        for fd in sockets:
            os.set_blocking(fd, True)


def _queued(stdout: TextIO, stderr: TextIO, queues: list[OutputQueue]) -> tuple[TextIO, TextIO]:
    """Return both streams with queues, and add these to ``queues``.

    Streams that write to the same file have one queue, so that the order is kept.
    """
    try:
        is_same = os.path.sameopenfile(stdout.fileno(), stderr.fileno())
    except OSError:  # in memory: captured by a test
        return stdout, stderr
    queues.append(OutputQueue(stderr.fileno()))
    if not is_same:
        queues.append(OutputQueue(stdout.fileno()))
    return _as_text(stdout, queues[-1]), _as_text(stderr, queues[0])


def _as_text(stream: TextIO, queue: OutputQueue) -> TextIO:
    return QueuedStream(stream, queue)  # type: ignore[return-value]


def _restore(stdout: TextIO, stderr: TextIO) -> None:
    if isinstance(sys.stderr, QueuedStream):
        sys.stdout, sys.stderr = stdout, stderr


def _do_not_block_c_code() -> list[int]:
    """Drop what rcl and the middleware print while nothing accepts it; return changed sockets.

    They print with the GIL or locks of the middleware held, which would stop all nodes.
    """
    sockets: list[int] = []
    for fd in (1, 2):
        with suppress(OSError):  # the terminal of another user
            mode = os.fstat(fd).st_mode
            if stat.S_ISSOCK(mode) and os.get_blocking(fd):  # such as to systemd's journal
                os.set_blocking(fd, False)
                sockets.append(fd)
            elif stat.S_ISFIFO(mode) or os.isatty(fd):
                _open_again(fd, os.O_NONBLOCK | os.O_NOCTTY)
    return sockets


def _open_again(fd: int, more_flags: int) -> None:
    """Replace ``fd`` by a new file description: flags of the present one affect other processes."""
    flags = fcntl.fcntl(fd, fcntl.F_GETFL) | more_flags
    opened = os.open(f"/proc/self/fd/{fd}", flags)
    os.dup2(opened, fd)
    os.close(opened)
