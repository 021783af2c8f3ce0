"""Diagnostics as text: the source line, a caret under the value, and related lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from composer.diagnostics import Diagnostic, Severity
from composer.report.display import visible
from composer.report.snippet import BOLD, FRAME, Annotation, Style, draw, snippets

_COLORS = {Severity.ERROR: "31", Severity.WARNING: "33", Severity.INFO: "36"}


#: The default maximum number of diagnostics in a report as text.
MAX_DIAGNOSTICS = 200


def render(
    diagnostics: Sequence[Diagnostic],
    *,
    color: bool = False,
    maximum: int | None = MAX_DIAGNOSTICS,
) -> str:
    """Return the diagnostics, separated by blank lines, and the summary of all of them.

    ``color`` adds ANSI colors. Of more than ``maximum`` diagnostics, the most severe are shown, in
    the same order; None shows all.
    """
    style = Style(color)
    shown = _most_severe(diagnostics, maximum)
    blocks = [_diagnostic(diagnostic, style) for diagnostic in shown]
    total = summary(diagnostics)
    if len(shown) < len(diagnostics):
        total += f"; showing {len(shown)} of {len(diagnostics)}"
    return "\n\n".join([*blocks, total]) + "\n"


def _most_severe(diagnostics: Sequence[Diagnostic], maximum: int | None) -> Sequence[Diagnostic]:
    if maximum is None or len(diagnostics) <= maximum:
        return diagnostics
    ranks = {severity: rank for rank, severity in enumerate(Severity)}
    numbers = sorted(range(len(diagnostics)), key=lambda n: ranks[diagnostics[n].severity])
    return [diagnostics[number] for number in sorted(numbers[:maximum])]


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
