"""Findings for people: the line, a caret under the very value, what else has to do with it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from composer.diagnostics import Diagnostic, Severity
from composer.report.display import visible
from composer.report.snippet import BOLD, FRAME, Mark, Pen, draw, snippets

_COLORS = {Severity.ERROR: "31", Severity.WARNING: "33", Severity.INFO: "36"}


def render(diagnostics: Sequence[Diagnostic], *, color: bool = False) -> str:
    """Return the findings one below the other, a blank line between them, and the summary.

    ``color`` adds ANSI colours; whether the reader can show them is for the caller to know.
    """
    pen = Pen(color)
    blocks = [_finding(diagnostic, pen) for diagnostic in diagnostics]
    return "\n\n".join([*blocks, summary(diagnostics)]) + "\n"


def summary(diagnostics: Iterable[Diagnostic]) -> str:
    """Return one line that counts the findings: ``found 3 errors, 1 warning``."""
    counts = Counter(diagnostic.severity for diagnostic in diagnostics)
    told = [
        f"{counts[severity]} {severity.value}{'s' if counts[severity] != 1 else ''}"
        for severity in Severity
        if counts[severity]
    ]
    return f"found {', '.join(told)}" if told else "no findings"


def _finding(diagnostic: Diagnostic, pen: Pen) -> str:
    rule = diagnostic.rule
    accent = _COLORS[rule.severity]
    head = pen.bold(f"{rule.severity.value}[{rule.code} {rule.name}]", accent)
    lines = [f"{head}: {pen.bold(visible(diagnostic.message))}"]
    marks = [Mark(diagnostic.primary, "^", (BOLD, accent))]
    marks += [Mark(label.span, "-", (FRAME,), label.message) for label in diagnostic.related]
    margin = max(len(str(mark.span.line)) for mark in marks)
    for index, group in enumerate(snippets(marks)):
        lines += draw(group, ":::" if index else "-->", pen, margin)
    if diagnostic.hint is not None:
        lines.append(f"{' ' * margin} {pen.frame('=')} hint: {visible(diagnostic.hint)}")
    return "\n".join(lines)
