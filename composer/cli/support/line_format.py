"""The format of log lines: RCUTILS_CONSOLE_OUTPUT_FORMAT, as for every ROS program.

See https://docs.ros.org/en/jazzy/Tutorials/Demos/Logging-and-logger-configuration.html.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from datetime import datetime
from typing import TYPE_CHECKING, TypeAlias

from composer.base.characters import escape_lines

if TYPE_CHECKING:
    from composer.client.run_log.reading import Record

CONSOLE_FORMAT_VARIABLE = "RCUTILS_CONSOLE_OUTPUT_FORMAT"
_FILE_FORMAT = "[{date_time_with_ms}] [{severity}] [{name}] {message}"
_TOKEN = re.compile(r"\{(\w+)\}")
_NANOSECONDS = 1_000_000_000
#: In the format, as in rcutils.
_ESCAPES = {"\\n": "\n", "\\t": "\t"}
_INDENT = "  "


_Part: TypeAlias = "Callable[[Record], str]"


class LineFormat:
    """A format with tokens such as ``{severity}``; unknown ones are kept."""

    def __init__(self, text: str) -> None:
        for escape, character in _ESCAPES.items():
            text = text.replace(escape, character)
        pieces = _TOKEN.split(text)  # text and names of tokens, in turn
        self._parts = [
            _TOKENS.get(piece, _constant(f"{{{piece}}}")) if index % 2 else _constant(piece)
            for index, piece in enumerate(pieces)
        ]

    def render(self, record: Record) -> str:
        """Return a record as text."""
        return "".join(part(record) for part in self._parts)


def console_format() -> LineFormat | None:
    """Return the format that the user has set; None for the default one."""
    from composer.runtime.middleware.environment import CONSOLE_FORMAT

    text = os.environ.get(CONSOLE_FORMAT_VARIABLE, CONSOLE_FORMAT)
    return None if text == CONSOLE_FORMAT else LineFormat(text)


def file_format() -> str:
    """Return the format for a log file: it has the date and time unless the user has set one."""
    from composer.runtime.middleware.environment import CONSOLE_FORMAT

    text = os.environ.get(CONSOLE_FORMAT_VARIABLE, CONSOLE_FORMAT)
    return _FILE_FORMAT if text == CONSOLE_FORMAT else text


def continued(text: str) -> str:
    """Return ``text`` with all lines but the first indented: a message must not look like two."""
    return escape_lines(text).replace("\n", f"\n{_INDENT}")


def _seconds(record: Record) -> str:
    return f"{record.time_ns // _NANOSECONDS}.{record.time_ns % _NANOSECONDS:09}"


def _date_and_time(record: Record) -> str:
    # In the local time zone, as rcutils writes it.
    at = datetime.fromtimestamp(record.time_ns / _NANOSECONDS)
    return at.isoformat(sep=" ", timespec="milliseconds")


def _constant(text: str) -> _Part:
    return lambda _: text


#: The place in the source code is not known.
_TOKENS: dict[str, _Part] = {
    "severity": lambda record: record.level.upper(),
    "name": lambda record: record.logger,
    "message": lambda record: continued(record.message),  # the format itself may have colors
    "time": _seconds,
    "time_as_nanoseconds": lambda record: str(record.time_ns),
    "date_time_with_ms": _date_and_time,
    "function_name": _constant(""),
    "file_name": _constant(""),
    "line_number": _constant("0"),
}
