"""The output of a child process as lines of a log: bounded, whatever the process writes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence

from composer.model import LogLevel

_LONGEST_LINE = 2000  # bytes
_CUT = b" ..."
#: More lines than this within a second are dropped: they cannot be read, and the log has to go on.
_MAX_LINES_PER_S = 500
#: The format that the composer asks the loggers of ROS for, see ``CONSOLE_FORMAT``.
#: Lines of ``compose run`` itself begin with the time since its start.
_ROS_LINE = re.compile(
    r"(?:\[\d+\.\d+\] )?\[(DEBUG|INFO|WARN|ERROR|FATAL)\] \[([^\]\s]+)\]:? (.*)", re.DOTALL
)
_COLORS = re.compile(rb"\x1b\[[0-9;]*m")


class OutputLines:
    """Splits the output of a process into lines, and passes them on as text."""

    def __init__(self, on_line: Callable[[str], None]) -> None:
        self._on_line = on_line
        self._rest = b""
        self._is_cut = False  # the rest of a line that was cut is dropped
        self._second = -1
        self._lines = 0
        self._dropped = 0

    def add(self, data: bytes, now_s: float) -> None:
        """Add what was read at a time of the monotonic clock."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            self._pass_on(line, now_s)
        if len(self._rest) > _LONGEST_LINE:
            if not self._is_cut:
                self._emit(self._rest[:_LONGEST_LINE] + _CUT)
            self._is_cut = True
            self._rest = b""

    def finish(self) -> None:
        """Pass on the last line if it has no end, and what was dropped."""
        if self._rest and not self._is_cut:
            self._emit(self._rest)
        self._rest = b""
        self._report_dropped()

    def _pass_on(self, line: bytes, now_s: float) -> None:
        if self._is_cut:
            self._is_cut = False
            return
        second = int(now_s)
        if second != self._second:
            self._second, self._lines = second, 0
            self._report_dropped()
        self._lines += 1
        if self._lines > _MAX_LINES_PER_S:
            self._dropped += 1
        elif len(line) > _LONGEST_LINE:
            self._emit(line[:_LONGEST_LINE] + _CUT)
        else:
            self._emit(line)

    def _report_dropped(self) -> None:
        if self._dropped:
            dropped, self._dropped = self._dropped, 0
            self._on_line(f"({dropped} lines were dropped: more than {_MAX_LINES_PER_S} a second)")

    def _emit(self, line: bytes) -> None:
        self._on_line(_COLORS.sub(b"", line).decode(errors="backslashreplace").rstrip("\r"))


def process_loggers(process: str, nodes: Iterable[str]) -> tuple[str, ...]:
    """Return the names that a process of a system may log with: its own, and its nodes'.

    ``nodes`` are full names. What the composer logs in the process is not among them, because
    classes in the process can print the same: it has the name of the process.
    """
    return process, *(name.strip("/").replace("/", ".") for name in nodes)


def attribute_line(
    text: str, loggers: Sequence[str], *, is_error: bool
) -> tuple[LogLevel, str, str]:
    """Return the level, the logger and the message of a line of a process.

    ``loggers`` are the names that the process may log with, and the parents of others. A line
    that no ROS logger has written has the first one, and the level of its stream. A program can
    print the name of any logger, so a line with another name has the first logger, and shows that
    name in its message.
    """
    match = _ROS_LINE.fullmatch(text)
    if match is None:
        return LogLevel.WARN if is_error else LogLevel.INFO, loggers[0], text
    severity, logger, message = match.groups()
    level = LogLevel(severity.lower())
    if logger in loggers or logger.startswith(tuple(f"{name}." for name in loggers)):
        return level, logger, message
    return level, loggers[0], f"[{logger}] {message}"
