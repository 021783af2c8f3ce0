"""A line of a file with marks under the parts that are meant."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from composer.report.display import visible, width
from composer.source import Span

#: Longer lines are shown as a piece around the mark, in characters.
LONGEST_LINE = 120
_BEFORE_MARK = 60

FRAME = "34"
BOLD = "1"


@dataclass(frozen=True, slots=True)
class Pen:
    """Writes with ANSI colours, or without."""

    color: bool

    def write(self, text: str, *codes: str) -> str:
        """Return ``text`` in the SGR ``codes``."""
        return f"\x1b[{';'.join(codes)}m{text}\x1b[0m" if self.color else text

    def bold(self, text: str, *codes: str) -> str:
        """Return ``text`` in bold."""
        return self.write(text, BOLD, *codes)

    def frame(self, text: str) -> str:
        """Return ``text`` as part of the frame around a line."""
        return self.write(text, FRAME)


@dataclass(frozen=True, slots=True)
class Mark:
    """A place to mark, what with, and the words behind that. ``codes`` are SGR codes."""

    span: Span
    sign: str
    codes: tuple[str, ...]
    message: str = ""


def snippets(marks: Iterable[Mark]) -> list[list[Mark]]:
    """Return the marks in groups that are shown under one line, in the order of their first."""
    groups: dict[tuple[str, int, int], list[Mark]] = {}
    for mark in marks:
        span = mark.span
        is_long = len(span.file.line(span.line)) > LONGEST_LINE
        key = (span.file.path, span.line, span.column if is_long else 0)
        groups.setdefault(key, []).append(mark)
    return list(groups.values())


def draw(marks: list[Mark], arrow: str, pen: Pen, margin: int) -> list[str]:
    """Return a line with all marks on it; ``margin`` is the width of the widest line number."""
    span = marks[0].span
    space = " " * margin
    bar = pen.frame("|")
    number = pen.frame(str(span.line).rjust(margin))
    shown, _, _ = _window(span)
    return [
        f"{space}{pen.frame(arrow)} {visible(str(span))}",
        f"{space} {bar}",
        f"{number} {bar} {visible(shown)}".rstrip(),
        *(f"{space} {bar} {_under(mark, pen)}" for mark in marks),
    ]


def _under(mark: Mark, pen: Pen) -> str:
    shown, column, length = _window(mark.span)
    before = width(shown[:column])
    cells = max(width(shown[column : column + length]), 1)
    note = f" {visible(mark.message)}" if mark.message else ""
    return f"{' ' * before}{pen.write(mark.sign * cells, *mark.codes)}{note}"


def _window(span: Span) -> tuple[str, int, int]:
    """Return the piece of the line to show, where in it the span begins, and how long it is."""
    line = span.file.line(span.line)
    column = min(max(span.column - 1, 0), len(line))
    length = min(span.length, len(line) - column)
    if len(line) <= LONGEST_LINE:
        return line, column, length
    start = max(0, min(column - _BEFORE_MARK, len(line) - LONGEST_LINE))
    end = start + LONGEST_LINE
    lead = "..." if start else ""
    tail = "..." if end < len(line) else ""
    return (
        f"{lead}{line[start:end]}{tail}",
        column - start + len(lead),
        min(length, end - column),
    )
