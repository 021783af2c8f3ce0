"""Diagnostics for the tests of reports."""

from __future__ import annotations

import json
from typing import Any

from composer.base.diagnostics import Diagnostic, Label, Rule, Severity
from composer.base.source import SourceFile, Span
from tests.programs import require_module


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


def check_sarif(log: Any) -> None:
    """Raise ValueError if the log does not match the OASIS schema of SARIF.

    The package pydantic-sarif is generated from ``sarif-schema-2.1.0.json``. It checks required,
    unknown properties, types, enumerations and minimum values, and no URIs and indexes.
    """
    # Not above: importing it takes longer than collecting a hundred files of tests.
    model = require_module("pydantic_sarif.model")
    model.StaticAnalysisResultsFormatSarifVersion210JsonSchema.model_validate_json(json.dumps(log))
