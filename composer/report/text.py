"""Diagnostics as text: the source line, a caret under the value, and related lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from composer.base.characters import counted, visible, width
from composer.base.diagnostics import Diagnostic, Severity
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span

#: SGR codes: the frame of source lines, bold text, and severities.
_FRAME = "34"
_BOLD = "1"
_COLORS = {Severity.ERROR: "31", Severity.WARNING: "33", Severity.INFO: "36"}
#: Of longer lines, in characters, only the part around the mark is shown.
_LONGEST_LINE = 120
_BEFORE_MARK = 60

#: The default maximum number of diagnostics in a report as text.
MAX_DIAGNOSTICS = 200


@dataclass(frozen=True, slots=True)
class _Style:
    """Formats text with or without ANSI colors."""

    color: bool

    def write(self, text: str, *codes: str) -> str:
        """Return ``text`` with the SGR ``codes``."""
        return f"\x1b[{';'.join(codes)}m{text}\x1b[0m" if self.color else text

    def bold(self, text: str, *codes: str) -> str:
        """Return ``text`` in bold."""
        return self.write(text, _BOLD, *codes)

    def frame(self, text: str) -> str:
        """Return ``text`` in the color of the frame."""
        return self.write(text, _FRAME)


@dataclass(frozen=True, slots=True)
class _Mark:
    """A span to mark, the marker character, SGR codes, and a message."""

    span: Span
    marker: str
    codes: tuple[str, ...]
    message: str = ""


def render(
    diagnostics: Sequence[Diagnostic], *, color: bool = False, maximum: int | None = MAX_DIAGNOSTICS
) -> str:
    """Return the diagnostics, separated by blank lines, and the summary of all of them.

    ``color`` adds ANSI colors. Of more than ``maximum`` diagnostics, the most severe are shown, in
    the same order; None shows all.
    """
    style = _Style(color)
    shown = _most_severe(diagnostics, maximum)
    blocks = [_diagnostic(diagnostic, style) for diagnostic in shown]
    total = summary(diagnostics)
    if len(shown) < len(diagnostics):
        total += f"; showing {len(shown)} of {len(diagnostics)}"
    return "\n\n".join([*blocks, total]) + "\n"


def excerpt(span: Span, *, color: bool = False) -> list[str]:
    """Return the lines that show a place: its source line with a caret under the value."""
    mark = _Mark(span, "^", (_BOLD, _COLORS[Severity.ERROR]))
    return _source_line([mark], "-->", _Style(color), len(str(span.line)))


def _most_severe(diagnostics: Sequence[Diagnostic], maximum: int | None) -> Sequence[Diagnostic]:
    if maximum is None or len(diagnostics) <= maximum:
        return diagnostics
    ranks = {severity: rank for rank, severity in enumerate(Severity)}
    numbers = sorted(range(len(diagnostics)), key=lambda n: ranks[diagnostics[n].severity])
    return [diagnostics[number] for number in sorted(numbers[:maximum])]


def summary(diagnostics: Iterable[Diagnostic]) -> str:
    """Return one line with the number of diagnostics: ``found 3 errors, 1 warning``."""
    counts = Counter(diagnostic.severity for diagnostic in diagnostics)
    found = [counted(counts[item], item.value) for item in Severity if counts[item]]
    return f"found {', '.join(found)}" if found else "no diagnostics"


def _diagnostic(diagnostic: Diagnostic, style: _Style) -> str:
    rule = diagnostic.rule
    accent = _COLORS[rule.severity]
    head = style.bold(f"{rule.severity.value}[{rule.code} {rule.name}]", accent)
    lines = [f"{head}: {style.bold(visible(diagnostic.message))}"]
    marks = [_Mark(diagnostic.primary, "^", (_BOLD, accent))]
    marks += [_Mark(label.span, "-", (_FRAME,), label.message) for label in diagnostic.related]
    margin = max(len(str(mark.span.line)) for mark in marks)
    for index, group in enumerate(_by_line(marks)):
        lines += _source_line(group, ":::" if index else "-->", style, margin)
    if diagnostic.hint is not None:
        lines.append(f"{' ' * margin} {style.frame('=')} hint: {visible(diagnostic.hint)}")
    return "\n".join(lines)


def _by_line(marks: Iterable[_Mark]) -> list[list[_Mark]]:
    """Group the marks that are shown under the same line, in the order of the first ones."""
    groups: dict[tuple[str, int, int], list[_Mark]] = {}
    for mark in marks:
        span = mark.span
        is_long = len(span.file.line(span.line)) > _LONGEST_LINE
        key = (span.file.path, span.line, span.column if is_long else 0)
        groups.setdefault(key, []).append(mark)
    return list(groups.values())


def _source_line(marks: list[_Mark], arrow: str, style: _Style, margin: int) -> list[str]:
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


def _under(mark: _Mark, style: _Style) -> str:
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
    if len(line) <= _LONGEST_LINE:
        return line, column, length
    start = max(0, min(column - _BEFORE_MARK, len(line) - _LONGEST_LINE))
    end = start + _LONGEST_LINE
    lead = "..." if start else ""
    tail = "..." if end < len(line) else ""
    return (
        f"{lead}{line[start:end]}{tail}",
        column - start + len(lead),
        min(length, end - column),
    )
