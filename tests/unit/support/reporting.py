"""Diagnostics for the tests of reports."""

from __future__ import annotations

from composer.base.diagnostics import Diagnostic, Label, Rule, Severity
from composer.base.source import SourceFile, Span


def rule(severity: Severity = Severity.ERROR, code: str = "RC202", name: str = "made-up") -> Rule:
    return Rule(code, name, severity)


def span_of(source: SourceFile, marked: str, line: int = 1) -> Span:
    """Return the span of the first ``marked`` on a line."""
    return Span(source, line, source.line(line).index(marked) + 1, len(marked))


def diagnostic(
    text: str,
    marked: str,
    message: str = "it is wrong",
    *,
    path: str = "systems/demo.yaml",
    line: int = 1,
    made_by: Rule | None = None,
    related: tuple[Label, ...] = (),
    hint: str | None = None,
) -> Diagnostic:
    source = SourceFile(path, text)
    return Diagnostic(made_by or rule(), message, span_of(source, marked, line), related, hint)
