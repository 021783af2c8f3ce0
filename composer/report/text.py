"""Diagnostics as text: the source line, a caret under the value, and related lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from composer.diagnostics import Diagnostic, Severity
from composer.report.display import visible
from composer.report.snippet import BOLD, FRAME, Annotation, Style, draw, snippets

_COLORS = {Severity.ERROR: "31", Severity.WARNING: "33", Severity.INFO: "36"}


def render(diagnostics: Sequence[Diagnostic], *, color: bool = False) -> str:
    """Return the diagnostics, separated by blank lines, and the summary.

    ``color`` adds ANSI colors.
    """
    style = Style(color)
    blocks = [_diagnostic(diagnostic, style) for diagnostic in diagnostics]
    return "\n\n".join([*blocks, summary(diagnostics)]) + "\n"


def summary(diagnostics: Iterable[Diagnostic]) -> str:
    """Return one line with the number of diagnostics: ``found 3 errors, 1 warning``."""
    counts = Counter(diagnostic.severity for diagnostic in diagnostics)
    counted = [
        f"{counts[severity]} {severity.value}{'s' if counts[severity] != 1 else ''}"
        for severity in Severity
        if counts[severity]
    ]
    return f"found {', '.join(counted)}" if counted else "no diagnostics"


def _diagnostic(diagnostic: Diagnostic, style: Style) -> str:
    rule = diagnostic.rule
    accent = _COLORS[rule.severity]
    head = style.bold(f"{rule.severity.value}[{rule.code} {rule.name}]", accent)
    lines = [f"{head}: {style.bold(visible(diagnostic.message))}"]
    marks = [Annotation(diagnostic.primary, "^", (BOLD, accent))]
    marks += [Annotation(label.span, "-", (FRAME,), label.message) for label in diagnostic.related]
    margin = max(len(str(mark.span.line)) for mark in marks)
    for index, group in enumerate(snippets(marks)):
        lines += draw(group, ":::" if index else "-->", style, margin)
    if diagnostic.hint is not None:
        lines.append(f"{' ' * margin} {style.frame('=')} hint: {visible(diagnostic.hint)}")
    return "\n".join(lines)
