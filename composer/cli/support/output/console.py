"""Console output that never blocks the program: a bounded queue and a thread for each stream.

Output stops when a terminal is paused (Ctrl-S), a pager waits for a key, or the collector of a log
hangs. See docs/decisions/0043-console-output.md.
"""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import TextIO

from composer.cli.support.output.c_streams import CStreams
from composer.cli.support.output.output_queue import FileDescriptor, OutputQueue
from composer.cli.support.output.streams import WrappedStream


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
    now = _queued(*before, queues)
    c_streams = CStreams(lambda fd, text: now[fd - 1].write(text))
    sys.stdout, sys.stderr = now
    try:
        os.register_at_fork(after_in_child=partial(_restore, *before))  # it has no thread
        yield
    finally:
        c_streams.finish()
        sys.stdout.flush()
        sys.stderr.flush()
        _restore(*before)
        is_written = [queue.close() for queue in queues]
        if all(is_written):  # otherwise C code would wait at the exit
            c_streams.restore()


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
