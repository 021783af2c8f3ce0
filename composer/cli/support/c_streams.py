"""Output of C code that does not wait until it can be written.

rcl and the middleware print with the GIL or locks of their own held: a wait would stop all nodes.
C gets other streams as ``stdout`` and ``stderr``, whose file descriptors do not block; what cannot
be written at once is dropped. The descriptors 1 and 2, which processes that user code starts
inherit, remain as they are. See docs/decisions/0010-output-never-blocks.md.
"""

from __future__ import annotations

import ctypes
import os
import stat
import sys
import threading
from contextlib import suppress

_NAMES = {1: "stdout", 2: "stderr"}
_LINE_BUFFERED = 1  # _IOLBF of <stdio.h>
_READ_BYTES = 65_536
_READ_WITHIN_S = 0.25


class CStream:
    """``stdout`` or ``stderr`` of C code: a variable, which programs may assign with glibc."""

    def __init__(self, number: int) -> None:
        """Find the stream whose usual descriptor is ``number``."""
        self._libc = ctypes.CDLL(None)
        self._libc.fdopen.restype = ctypes.c_void_p
        self._file = None
        if hasattr(self._libc, "gnu_get_libc_version"):  # it is a constant in other C libraries
            self._file = ctypes.c_void_p.in_dll(self._libc, _NAMES[number])
        self._usual = None if self._file is None else self._file.value

    @property
    def fd(self) -> int | None:
        """The descriptor that it writes to now; None if it cannot be redirected."""
        return None if self._file is None else int(self._libc.fileno(self._file))

    def redirect(self, fd: int) -> bool:
        """Write to ``fd`` from now on; return False if that is not possible.

        Load libraries that copy the variable after this call.
        """
        stream = None if self._file is None else self._libc.fdopen(fd, b"w")
        if self._file is None or stream is None:
            return False
        self._libc.fflush(self._file)
        self._libc.setvbuf(ctypes.c_void_p(stream), None, _LINE_BUFFERED, 0)
        self._file.value = stream
        return True

    def restore(self) -> None:
        """Write to the usual descriptor again."""
        if self._file is not None:
            self._file.value = self._usual


def crash_fd() -> int:
    """Return the descriptor for the last words of the process.

    It does not block in a run, unless it is a socket: nothing may read a pipe any more.
    """
    with suppress(OSError):  # it is closed
        if not stat.S_ISSOCK(os.fstat(2).st_mode):
            return CStream(2).fd or 2
    return 2


class CStreams:
    """Both streams of C code, redirected to descriptors that do not block."""

    def __init__(self) -> None:
        self._streams: dict[int, CStream] = {}  # by the usual descriptors
        self._readers: dict[int, threading.Thread] = {}  # those of pipes, by the descriptors

    def redirect(self) -> None:
        """Redirect streams to pipes and terminals, and forward those to sockets.

        Call it before libraries of ROS are loaded. Another call has no effect.
        """
        if self._streams:
            return
        self._streams = {number: CStream(number) for number in _NAMES}
        for number in _NAMES:
            with suppress(OSError):  # the terminal of another user
                self._redirect(number)
        os.register_at_fork(after_in_child=self.restore)

    def finish(self) -> None:
        """Forward what C code has printed so far; drop what it prints from now on to a socket."""
        while self._readers:
            fd, reader = self._readers.popitem()
            null = os.open(os.devnull, os.O_WRONLY | os.O_CLOEXEC)
            os.dup2(null, fd, inheritable=False)  # closes the pipe
            os.close(null)
            reader.join(_READ_WITHIN_S)

    def restore(self) -> None:
        """Let them write to the usual descriptors again.

        Their own descriptors stay open, for the last words of a process that hangs.
        """
        for stream in self._streams.values():
            stream.restore()

    def _redirect(self, number: int) -> None:
        mode = os.fstat(number).st_mode
        if stat.S_ISSOCK(mode):  # it cannot be opened again
            fd = self._pipe(number)
        elif stat.S_ISFIFO(mode) or os.isatty(number):
            # Not a duplicate: it would share the flag with descriptor 1 or 2.
            flags = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
            fd = os.open(f"/proc/self/fd/{number}", flags)
        else:
            return
        if not self._streams[number].redirect(fd):
            os.close(fd)

    def _pipe(self, number: int) -> int:
        """Return the end of a pipe; forward what is written to it."""
        reading, writing = os.pipe2(os.O_CLOEXEC)
        os.set_blocking(writing, False)
        name = f"console {_NAMES[number]}"
        reader = threading.Thread(target=self._read, args=(number, reading), name=name, daemon=True)
        reader.start()
        self._readers[writing] = reader
        return writing

    def _read(self, number: int, fd: int) -> None:
        with os.fdopen(fd, "rb", buffering=0) as pipe:
            while data := pipe.read(_READ_BYTES):
                (sys.stdout, sys.stderr)[number - 1].write(data.decode(errors="replace"))


#: Those of this process.
C_STREAMS = CStreams()
