"""Output streams: data to stdout, messages to stderr, colors only on terminals.

Names, messages and parameters come from other processes and may contain anything. What would
control the terminal is escaped here, so that no command has to. Only the command knows what belongs
on one line: :func:`lines` and :func:`columns` escape line breaks too.
"""

from __future__ import annotations

import io
import json
import os
import select
import sys
import termios
import tty
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any, BinaryIO, NoReturn, Self, TextIO

from composer.base.characters import escape_json, escape_line, escape_lines, is_safe, visible, width

#: The exit code that shells report after a write to a closed pipe (128 + SIGPIPE).
CLOSED_PIPE = 141


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


def write(text: str) -> None:
    """Print ``text`` and a newline to stdout. Ends the process quietly if the pipe is closed."""
    try:
        print(escape_lines(text), flush=True)
    except BrokenPipeError:
        _end_quietly()


def write_raw(text: str) -> None:
    """Write exactly ``text`` to stdout, like :func:`write`, with its colors and controls."""
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        _end_quietly()


def write_bytes(data: bytes) -> None:
    """Write binary data to stdout, like :func:`write_raw`."""
    try:
        sys.stdout.flush()
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
    except BrokenPipeError:
        _end_quietly()


def say(text: str) -> None:
    """Print ``text``, a message for the user, to stderr."""
    say_raw(escape_lines(text))


def say_raw(text: str) -> None:
    """Print exactly ``text`` to stderr, like :func:`say`, with its colors and controls."""
    print(text, file=sys.stderr, flush=True)


def lines(texts: Iterable[str]) -> str:
    """Return texts as one line each."""
    return "\n".join(map(escape_line, texts))


def columns(rows: Sequence[Sequence[str]], numbers_from: int | None = None) -> str:
    """Return the rows as lines with their cells aligned, two spaces apart.

    Columns from ``numbers_from`` on (counted from 0) are right-aligned. A line break in a cell is
    escaped; wide characters take two columns of the terminal.
    """
    safe_rows = [[visible(cell) for cell in row] for row in rows]
    widths = [max(map(width, column)) for column in zip(*safe_rows, strict=True)]
    numbers = len(widths) if numbers_from is None else numbers_from

    def padded(cell: str, index: int) -> str:
        space = " " * (widths[index] - width(cell))
        return f"{cell}{space}" if index < numbers else f"{space}{cell}"

    return "\n".join(
        "  ".join(padded(cell, index) for index, cell in enumerate(row)).rstrip()
        for row in safe_rows
    )


def use_color(stream: TextIO) -> bool:
    """Say whether to use colors: NO_COLOR and FORCE_COLOR decide, else whether it is a terminal.

    See https://no-color.org and https://force-color.org.
    """
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return stream.isatty() and os.environ.get("TERM") != "dumb"


class Keys:
    """Reads keys from the terminal one by one, without echo, for a ``with`` block.

    There are none if stdin is not a terminal, or if this program is in the background.
    """

    def __init__(self, *, enabled: bool = True) -> None:
        self._before: list[Any] = []
        number = sys.stdin.fileno() if enabled and sys.stdin.isatty() else None
        #: Whether keys can be read.
        self.enabled = number is not None and os.tcgetpgrp(number) == os.getpgrp()

    def __enter__(self) -> Self:
        if self.enabled:
            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
        return self

    def __exit__(self, *_: object) -> None:
        if self.enabled:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)

    def pressed(self) -> str | None:
        """Return the next key that was pressed; None if there is none, empty after the last."""
        with suppress(OSError):
            if self.enabled and select.select([sys.stdin], [], [], 0.0)[0]:
                return os.read(sys.stdin.fileno(), 1).decode(errors="replace")
        return None


def keep_stdout_for_data() -> None:
    """Redirect what libraries print to file descriptor 1 to stderr.

    Fast DDS prints errors there, which would corrupt the data that another program reads.
    """
    stdout = sys.__stdout__
    if stdout is None or sys.stdout is not stdout:  # done already, or captured by a test
        return
    stdout.flush()
    ours = os.dup(stdout.fileno())
    os.dup2(sys.stderr.fileno(), stdout.fileno())
    sys.stdout = os.fdopen(ours, "w", encoding=stdout.encoding, errors=stdout.errors)


def _end_quietly() -> NoReturn:
    drop(sys.stdout)
    raise SystemExit(CLOSED_PIPE)


def as_yaml(value: Any) -> str:
    """Return plain data as YAML, keys in their order."""
    import yaml

    def dump(*, allow_unicode: bool) -> str:
        text: str = yaml.safe_dump(
            value, sort_keys=False, allow_unicode=allow_unicode, width=120, default_flow_style=False
        )
        return text

    text = dump(allow_unicode=True)
    if not is_safe(text):  # PyYAML does not escape characters that change the direction of text
        text = dump(allow_unicode=False)
    return text.removesuffix("\n...\n").rstrip("\n")  # the dots end a document of one scalar


def as_json(value: Any, *, indent: int | None = None) -> str:
    """Return plain data as JSON; one line unless ``indent`` is given.

    Numbers that JSON lacks become strings, as YAML writes them: ``".nan"``, ``"-.inf"``.
    """
    try:
        text = json.dumps(value, ensure_ascii=False, indent=indent, allow_nan=False)
    except ValueError:
        from composer.language.document.scalars import with_json_numbers

        text = json.dumps(with_json_numbers(value), ensure_ascii=False, indent=indent)
    return escape_json(text)


def truncated(value: Any, max_length: int) -> Any:
    """Return plain data with lists and strings cut to ``max_length`` items."""
    if isinstance(value, dict):
        return {name: truncated(item, max_length) for name, item in value.items()}
    if isinstance(value, list):
        shown = [truncated(item, max_length) for item in value[:max_length]]
        return shown if len(value) <= max_length else [*shown, f"... {len(value)} items"]
    if isinstance(value, str) and len(value) > max_length:
        return f"{value[:max_length]}..."
    return value


def write_list(kind: str, rows: Sequence[Sequence[str]], data: Any, *, json: bool) -> None:
    """Print ``data`` as JSON, or ``rows`` as a table; explain an empty list on stderr."""
    if json:
        write(as_json(data, indent=2))
    elif rows:
        write(columns(rows))
    else:
        say(f"no {kind} found: check that the system is running and that ROS_DOMAIN_ID is the same")
