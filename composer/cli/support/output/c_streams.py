"""Output of C code that does not wait until it can be written.

rcl and the middleware print with the GIL or locks of their own held: a wait would stop all nodes.
Their ``stdout`` and ``stderr`` (FILE) get file descriptors of their own that do not block; what
cannot be written at once is dropped. The descriptors 1 and 2, which processes that user code starts
inherit, remain as they are. See docs/decisions/0043-console-output.md.
"""

from __future__ import annotations

import ctypes
import os
import stat
import threading
from collections.abc import Callable
from contextlib import suppress

#: The place of ``_fileno`` in glibc's ``struct _IO_FILE``, which is part of its binary interface:
#: flags, eleven pointers of buffers, and those of the markers and the next file come first.
_FILENO_OFFSET = 14 * ctypes.sizeof(ctypes.c_void_p)
_NAMES = {1: "stdout", 2: "stderr"}
_READ_BYTES = 65_536
_READ_WITHIN_S = 0.25

#: Receives what C code prints to descriptor 1 or 2, if it cannot be written there directly.
Forward = Callable[[int, str], object]


class CStream:
    """``stdout`` or ``stderr`` of C code. Without glibc, it cannot be redirected."""

    def __init__(self, number: int) -> None:
        """Find the stream whose usual descriptor is ``number``."""
        self._libc = ctypes.CDLL(None)
        self._file = None
        with suppress(ValueError):  # no such variable
            self._file = ctypes.c_void_p(ctypes.c_void_p.in_dll(self._libc, _NAMES[number]).value)

    @property
    def fd(self) -> int | None:
        """The descriptor that it writes to now; None if there is no such stream."""
        return None if self._file is None else int(self._libc.fileno(self._file))

    def redirect(self, fd: int) -> bool:
        """Write to ``fd`` from now on; return False if that is not possible."""
        if self._file is None:
            return False
        place = ctypes.c_int.from_address((self._file.value or 0) + _FILENO_OFFSET)
        if place.value != self.fd:
            return False
        self._libc.flockfile(self._file)
        self._libc.fflush(self._file)
        self._libc["__fpurge"](self._file)  # what the descriptor does not accept
        place.value = fd
        self._libc.funlockfile(self._file)
        return self.fd == fd


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

    def __init__(self, forward: Forward) -> None:
        """Redirect streams to pipes and terminals, and let ``forward`` write those to sockets."""
        self._forward = forward
        self._redirected: list[int] = []  # the usual descriptors
        self._readers: dict[int, threading.Thread] = {}  # those of pipes, by the descriptors
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
        for number in self._redirected:
            CStream(number).redirect(number)

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
        if CStream(number).redirect(fd):
            self._redirected.append(number)
        else:
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
                self._forward(number, data.decode(errors="replace"))
