"""A line of a file with marks under the part that is meant."""

from __future__ import annotations

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
class Snippet:
    """A place to show, and how: the arrow before it, the mark under it, the words behind that.

    ``codes`` are the SGR codes of the mark.
    """

    span: Span
    arrow: str
    mark: str
    codes: tuple[str, ...]
    message: str = ""

    def lines(self, pen: Pen, margin: int) -> list[str]:
        """Return the lines; ``margin`` is the width of the widest line number around."""
        shown, column, length = _window(self.span)
        before = width(shown[:column])
        under = max(width(shown[column : column + length]), 1)
        space = " " * margin
        bar = pen.frame("|")
        number = pen.frame(str(self.span.line).rjust(margin))
        marks = pen.write(self.mark * under, *self.codes)
        note = f" {visible(self.message)}" if self.message else ""
        return [
            f"{space}{pen.frame(self.arrow)} {visible(str(self.span))}",
            f"{space} {bar}",
            f"{number} {bar} {visible(shown)}".rstrip(),
            f"{space} {bar} {' ' * before}{marks}{note}",
        ]


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
