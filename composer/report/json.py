"""Diagnostics as JSON, as described in ``schemas/report.schema.json``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from composer.diagnostics import Diagnostic, Severity
from composer.report.fingerprint import fingerprints
from composer.report.tool import NAME, tool_version
from composer.source import Span

#: Incremented for every incompatible change of the format.
FORMAT_VERSION = 1


def render(diagnostics: Sequence[Diagnostic]) -> str:
    """Return the report as one JSON object, indented, with a newline at the end."""
    report = {
        "version": FORMAT_VERSION,
        "tool": {"name": NAME, "version": tool_version()},
        "summary": {
            f"{severity.value}s": sum(item.severity is severity for item in diagnostics)
            for severity in Severity
        },
        "diagnostics": [
            _diagnostic(diagnostic, fingerprint)
            for diagnostic, fingerprint in zip(diagnostics, fingerprints(diagnostics), strict=True)
        ],
    }
    return json.dumps(report, indent=2) + "\n"


def _diagnostic(diagnostic: Diagnostic, fingerprint: str) -> dict[str, Any]:
    return {
        "code": diagnostic.rule.code,
        "rule": diagnostic.rule.name,
        "severity": diagnostic.severity.value,
        "message": diagnostic.message,
        "hint": diagnostic.hint,
        "location": _location(diagnostic.primary),
        "related": [
            {"message": label.message, "location": _location(label.span)}
            for label in diagnostic.related
        ],
        "fingerprint": fingerprint,
    }


def _location(span: Span) -> dict[str, Any]:
    return {
        "file": span.file.path,
        "line": span.line,
        "column": span.column,
        "end_column": span.column + span.length,
    }
