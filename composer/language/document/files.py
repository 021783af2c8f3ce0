"""Read files safely: too large, not a regular file, or in another encoding."""

from __future__ import annotations

import codecs
import os
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from composer.base.diagnostics import Diagnostic, nearest, shown
from composer.base.regular_files import FileTooLargeError, NotRegularError, read_regular
from composer.base.source import SourceFile, Span
from composer.language.document.limits import MAX_BYTES
from composer.language.document.rules import TOO_LARGE, UNREADABLE_FILE

_LONGEST_PATH = 4096  # PATH_MAX of Linux
_ENTRIES_FOR_HINT = 1000
_WIDE_ENCODINGS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}


class _NotRead(Exception):
    """A file cannot be read; the message and the hint of the diagnostic."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


def read_bytes(path: Path, source: SourceFile) -> tuple[bytes, list[Diagnostic]]:
    """Return the content of a regular file of at most MAX_BYTES, or a diagnostic."""
    start = Span(source, 1, 1)
    try:
        data = _read(path)
    except _NotRead as problem:
        return b"", [Diagnostic(UNREADABLE_FILE, str(problem), start, hint=problem.hint)]
    if data is None:
        return b"", [too_large(source)]
    return data, []


def too_large(source: SourceFile) -> Diagnostic:
    """Return the diagnostic for a text of more than MAX_BYTES."""
    return Diagnostic(
        TOO_LARGE,
        f"this file is larger than {MAX_BYTES:,} bytes",
        Span(source, 1, 1),
        hint="split the system, or declare repeated nodes once as a node type",
    )


def decode(data: bytes, shown_path: str) -> tuple[SourceFile, list[Diagnostic]]:
    """Return the text of UTF-8 ``data`` (a byte-order mark is dropped), or a diagnostic."""
    content = data.removeprefix(codecs.BOM_UTF8)
    try:
        return SourceFile(shown_path, content.decode("utf-8")), []
    except UnicodeDecodeError as error:
        source = SourceFile(shown_path, content.decode("utf-8", errors="replace"))
        before = SourceFile("", content[: error.start].decode("utf-8")).lines
        span = Span(source, len(before), len(before[-1]) + 1)
        return source, [_not_utf8(content, error.start, span)]


def _not_utf8(data: bytes, offset: int, span: Span) -> Diagnostic:
    encoding = _WIDE_ENCODINGS.get(data[:2])
    if encoding is not None:
        message = f"this file is {encoding}, not UTF-8"
    else:
        message = f"the byte 0x{data[offset]:02x} is not UTF-8"
    return Diagnostic(UNREADABLE_FILE, message, span, hint="save the file as UTF-8")


def _read(path: Path) -> bytes | None:
    """Return the content, or None if it is too large. Raises _NotRead."""
    try:
        return read_regular(path, MAX_BYTES)
    except FileTooLargeError:
        return None
    except FileNotFoundError:
        raise _NotRead("there is no such file", _similar_name(path)) from None
    except NotRegularError as error:
        raise _NotRead(error.strerror or str(error)) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        raise _NotRead(f"this file cannot be read: {reason or error}") from None


def _similar_name(path: Path) -> str | None:
    name = nearest(path.name, _sibling_names(path))
    if name is None:
        return None
    # Do not shorten the path: its end is the part that differs.
    return f"did you mean '{shown(path.with_name(name), limit=_LONGEST_PATH)}'?"


def _sibling_names(path: Path) -> Iterator[str]:
    try:
        with os.scandir(path.parent) as entries:
            yield from (entry.name for entry in islice(entries, _ENTRIES_FOR_HINT))
    except (OSError, ValueError):
        return
