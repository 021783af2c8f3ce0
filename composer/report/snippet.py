"""Source lines with marked spans, for the text format."""

from __future__ import annotations

from collections.abc import Iterable

from composer.fast_dataclass import dataclass
from composer.report.display import visible, width
from composer.source import Span

#: Of longer lines, in characters, only the part around the mark is shown.
LONGEST_LINE = 120
_BEFORE_MARK = 60

FRAME = "34"
BOLD = "1"


@dataclass(frozen=True, slots=True)
class Style:
    """Formats text with or without ANSI colors."""

    color: bool

    def write(self, text: str, *codes: str) -> str:
        """Return ``text`` with the SGR ``codes``."""
        return f"\x1b[{';'.join(codes)}m{text}\x1b[0m" if self.color else text

    def bold(self, text: str, *codes: str) -> str:
        """Return ``text`` in bold."""
        return self.write(text, BOLD, *codes)

    def frame(self, text: str) -> str:
        """Return ``text`` in the color of the frame."""
        return self.write(text, FRAME)


@dataclass(frozen=True, slots=True)
class Annotation:
    """A span to mark, the marker character, SGR codes, and a message."""

    span: Span
    marker: str
    codes: tuple[str, ...]
    message: str = ""


def snippets(marks: Iterable[Annotation]) -> list[list[Annotation]]:
    """Group the marks that are shown under the same line, in the order of the first ones."""
    groups: dict[tuple[str, int, int], list[Annotation]] = {}
    for mark in marks:
        span = mark.span
        is_long = len(span.file.line(span.line)) > LONGEST_LINE
        key = (span.file.path, span.line, span.column if is_long else 0)
        groups.setdefault(key, []).append(mark)
    return list(groups.values())


def draw(marks: list[Annotation], arrow: str, style: Style, margin: int) -> list[str]:
    """Return a source line with its marks; ``margin`` is the width of the line numbers."""
    span = marks[0].span
    space = " " * margin
    bar = style.frame("|")
    number = style.frame(str(span.line).rjust(margin))
    shown, _, _ = _window(span)
    return [
        f"{space}{style.frame(arrow)} {visible(str(span))}",
        f"{space} {bar}",
        f"{number} {bar} {visible(shown)}".rstrip(),
        *(f"{space} {bar} {_under(mark, style)}" for mark in marks),
    ]


def _under(mark: Annotation, style: Style) -> str:
    shown, column, length = _window(mark.span)
    before = width(shown[:column])
    cells = max(width(shown[column : column + length]), 1)
    note = f" {visible(mark.message)}" if mark.message else ""
    return f"{' ' * before}{style.write(mark.marker * cells, *mark.codes)}{note}"


def _window(span: Span) -> tuple[str, int, int]:
    """Return the part of the line to show, and the start and length of the span in it."""
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
