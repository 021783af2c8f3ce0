"""Console output that never blocks the program: a bounded queue and a thread for each stream.

Output stops when a terminal is paused (Ctrl-S), a pager waits for a key, or the collector of a log
hangs. See docs/decisions/0010-output-never-blocks.md.
"""

from __future__ import annotations

import os
import select
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Protocol, TextIO

from composer.cli.support.c_streams import C_STREAMS
from composer.cli.support.terminal import WrappedStream

#: Text that may wait; beyond that, the oldest is dropped.
_MAX_WAITING_CHARACTERS = 1_048_576
#: One write. If all threads are busy, this thread gets the GIL every 5 ms: with writes of 4 KiB, it
#: would drop lines that could be written.
_WRITE_CHARACTERS = 65_536
#: One write at the end, when the program waits for progress.
_LAST_WRITE_CHARACTERS = 4096
#: At the end, waiting text is given up if none of it is written in so many waits in a row: if the
#: computer stops for a second, that is one of them.
_WAIT_S = 0.25
_STALLED_WAITS = 4
#: In any case, it is given up after so many waits.
_MAX_WAITS = 12


class Sink(Protocol):
    """Where an :class:`OutputQueue` writes, on its thread."""

    def write(self, data: bytes) -> int:
        """Write the beginning of ``data``; return the number of bytes written. Raises OSError."""

    def close(self) -> None:
        """Release what the sink holds."""


class FileDescriptor:
    """A duplicate of a file descriptor, which may be non-blocking."""

    def __init__(self, fd: int) -> None:
        self._fd = os.dup(fd)
        self._writable = select.poll()
        self._writable.register(self._fd, select.POLLOUT)

    def write(self, data: bytes) -> int:
        """Write the beginning of ``data``, once that is possible."""
        while True:
            try:
                return os.write(self._fd, data)
            except BlockingIOError:  # another program has set the flag
                self._writable.poll()

    def close(self) -> None:
        """Close the duplicate."""
        os.close(self._fd)


class OutputQueue:
    """Writes texts to a sink, in order, on a thread of its own.

    If texts were dropped, ``note(number of lines)`` follows when output is possible again. A closed
    pipe drops everything without an error.
    """

    def __init__(
        self,
        sink: Sink,
        note: Callable[[int], str],
        max_waiting: int = _MAX_WAITING_CHARACTERS,
        name: str = "console",
    ) -> None:
        """Let ``max_waiting`` characters wait. ``name`` is the name of the thread."""
        self._sink = sink
        self._note = note
        self._max_waiting = max_waiting
        # Reentrant: garbage collection may run a finalizer that prints, at any allocation.
        self._lock = threading.RLock()
        self._texts: deque[str] = deque()
        self._waiting = 0
        self._dropped_lines = 0
        self._written_bytes = 0
        self._is_closing = False
        self._is_writing = False
        self._is_broken = False
        self._is_idle = False
        self._wakeup = threading.Lock()  # a binary semaphore: the thread sleeps on it
        self._wakeup.acquire()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
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

    def close(self) -> bool:
        """Write what waits, as long as the other side reads, and end the thread.

        Return whether everything was written.
        """
        with self._lock:
            self._is_closing = True
            if self._is_idle:
                self._wake()
        stalled = 0
        for _ in range(_MAX_WAITS):
            before = self._written_bytes
            self._thread.join(_WAIT_S)
            # On a busy machine, the thread may not have had a turn yet.
            is_stalled = self._is_writing and self._written_bytes == before
            stalled = stalled + 1 if is_stalled else 0
            if stalled == _STALLED_WAITS or not self._thread.is_alive():
                break
        return not self._thread.is_alive()

    @property
    def has_dropped(self) -> bool:
        """Whether lines are missing that no note in the output reports."""
        return self._dropped_lines > 0

    def _wake(self) -> None:
        self._is_idle = False
        self._wakeup.release()

    def _run(self) -> None:
        while True:
            text = self._take()
            if text:
                self._write(text.encode(errors="backslashreplace"))
            elif self._is_closing:
                self._sink.close()
                return
            else:
                self._wakeup.acquire()

    def _take(self) -> str:
        """Remove and return the next texts; if there are none, become idle."""
        with self._lock:
            taken: list[str] = []
            length = 0
            if self._dropped_lines and self._texts:
                taken.append(self._note(self._dropped_lines))
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
            self._is_writing = True
            try:
                count = self._sink.write(data)
            except BrokenPipeError:
                self._is_broken = True
            except OSError:  # such as a full disk
                with self._lock:
                    self._dropped_lines += data.count(b"\n")
                return
            else:
                self._written_bytes += count
                data = data[count:]
            finally:
                self._is_writing = False


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
    sys.stdout, sys.stderr = _queued(*before, queues)
    C_STREAMS.redirect()
    try:
        os.register_at_fork(after_in_child=partial(_restore, *before))  # it has no thread
        yield
    finally:
        C_STREAMS.finish()
        sys.stdout.flush()
        sys.stderr.flush()
        _restore(*before)
        is_written = [queue.close() for queue in queues]
        if all(is_written):  # otherwise C code would wait at the exit
            C_STREAMS.restore()


def _queued(stdout: TextIO, stderr: TextIO, queues: list[OutputQueue]) -> tuple[TextIO, TextIO]:
    """Return both streams with queues, and add these to ``queues``.

    Streams that write to the same file have one queue, so that the order is kept.
    """
    try:
        is_same = os.path.sameopenfile(stdout.fileno(), stderr.fileno())
    except OSError:  # in memory: captured by a test
        return stdout, stderr
    queues.append(OutputQueue(FileDescriptor(stderr.fileno()), _note))
    if not is_same:
        queues.append(OutputQueue(FileDescriptor(stdout.fileno()), _note))
    return _as_text(stdout, queues[-1]), _as_text(stderr, queues[0])


def _note(dropped_lines: int) -> str:
    return f"... {dropped_lines} lines dropped: the output was blocked\n"


def _as_text(stream: TextIO, queue: OutputQueue) -> TextIO:
    return QueuedStream(stream, queue)  # type: ignore[return-value]


def _restore(stdout: TextIO, stderr: TextIO) -> None:
    if isinstance(sys.stderr, QueuedStream):
        sys.stdout, sys.stderr = stdout, stderr
