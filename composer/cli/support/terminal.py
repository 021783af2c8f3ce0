"""The terminal: data to stdout, talk to stderr, colours only where they can be seen."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import NoReturn, TextIO

#: What a shell reports for a program that wrote into a closed pipe (128 + SIGPIPE).
CLOSED_PIPE = 141


def write(text: str) -> None:
    """Print ``text``, which is data, and a newline. Ends the process quietly when nobody reads."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        _end_quietly()


def write_raw(text: str) -> None:
    """Like :func:`write`, but exactly ``text``."""
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        _end_quietly()


def write_bytes(data: bytes) -> None:
    """Like :func:`write_raw`, for data that is no text."""
    try:
        sys.stdout.flush()
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
    except BrokenPipeError:
        _end_quietly()


def say(text: str) -> None:
    """Print ``text``, which is for the person and no data, to stderr."""
    print(text, file=sys.stderr, flush=True)


def columns(rows: Sequence[Sequence[str]], numbers_from: int | None = None) -> str:
    """Return the rows as lines with their cells aligned, two spaces apart.

    Columns from ``numbers_from`` on (counted from 0) are aligned on the right.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    numbers = len(widths) if numbers_from is None else numbers_from
    return "\n".join(
        "  ".join(
            cell.ljust(width) if index < numbers else cell.rjust(width)
            for index, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def use_color(stream: TextIO) -> bool:
    """Say whether ``stream`` shows colours: NO_COLOR and FORCE_COLOR decide, else a terminal.

    See https://no-color.org and https://force-color.org.
    """
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def keep_stdout_for_data() -> None:
    """Lead what libraries print to file descriptor 1 to stderr; stdout stays ours alone.

    Fast DDS prints its errors there, where another program may be reading what we write.
    """
    stdout = sys.__stdout__
    if stdout is None or sys.stdout is not stdout:  # done already, or somebody captures it
        return
    stdout.flush()
    ours = os.dup(stdout.fileno())
    os.dup2(sys.stderr.fileno(), stdout.fileno())
    sys.stdout = os.fdopen(ours, "w", encoding=stdout.encoding, errors=stdout.errors)


def drop_stdout() -> None:
    """Let stdout lead nowhere, so that nothing fails on a closed pipe any more."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def _end_quietly() -> NoReturn:
    drop_stdout()
    raise SystemExit(CLOSED_PIPE)
