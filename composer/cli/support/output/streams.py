"""Standard streams in other clothes: text streams that write to another one in their own way."""

from __future__ import annotations

import io
import os
from typing import BinaryIO, TextIO


class WrappedStream(io.TextIOBase):
    """A text stream with the properties of another one. Subclasses write."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def writable(self) -> bool:
        """Return true."""
        return True

    def isatty(self) -> bool:
        """Return whether the output goes to a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Return the file descriptor of the underlying stream."""
        return self._stream.fileno()

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """The encoding of the underlying stream."""
        return self._stream.encoding

    @property
    def buffer(self) -> BinaryIO:
        """The bytes of the underlying stream."""
        return self._stream.buffer


class TolerantStream(WrappedStream):
    """Drops what cannot be written: for messages, without which a command still does its work."""

    def write(self, text: str) -> int:
        """Write ``text``; after an error, such as a closed pipe, nothing more is written."""
        try:
            return self._stream.write(text)
        except OSError:
            drop(self._stream)
            return len(text)

    def flush(self) -> None:
        """Flush the underlying stream."""
        try:
            self._stream.flush()
        except OSError:
            drop(self._stream)


def drop(stream: TextIO) -> None:
    """Redirect a stream to the null device, so that later writes and the last flush succeed."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, stream.fileno())
    os.close(null)
