"""Diagnostics as SARIF 2.1.0 (OASIS), for code-scanning services."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import PurePosixPath
from typing import Any
from urllib.parse import quote

from composer.diagnostics import Diagnostic, Rule, Severity
from composer.report.fingerprint import fingerprints
from composer.report.rule_page import page_of
from composer.report.tool import NAME, tool_version
from composer.source import Span

SCHEMA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)
#: The version after the slash changes with the algorithm of the fingerprints.
FINGERPRINT = "composerDiagnostic/v1"

_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}


def render(diagnostics: Sequence[Diagnostic]) -> str:
    """Return a SARIF log with one run; it describes every rule that has a diagnostic."""
    rules = sorted({item.rule for item in diagnostics}, key=lambda rule: rule.code)
    places = {rule.code: index for index, rule in enumerate(rules)}
    prints = fingerprints(diagnostics)
    run = {
        "tool": {
            "driver": {
                "name": NAME,
                "version": tool_version(),
                "rules": [_rule(rule) for rule in rules],
            }
        },
        "columnKind": "unicodeCodePoints",
        "results": [
            _result(item, places[item.rule.code], fingerprint)
            for item, fingerprint in zip(diagnostics, prints, strict=True)
        ],
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2) + "\n"


def _rule(rule: Rule) -> dict[str, Any]:
    page = page_of(rule)
    return {
        "id": rule.code,
        "name": rule.name,
        "shortDescription": {"text": page.summary},
        "fullDescription": {"text": page.why},
        "help": {"text": f"{page.summary}\n\n{page.why}\n\nInstead:\n\n{page.good}"},
        "defaultConfiguration": {"level": _LEVELS[rule.severity]},
    }


def _result(diagnostic: Diagnostic, rule_index: int, fingerprint: str) -> dict[str, Any]:
    hint = f"\n{diagnostic.hint}" if diagnostic.hint is not None else ""
    result: dict[str, Any] = {
        "ruleId": diagnostic.rule.code,
        "ruleIndex": rule_index,
        "level": _LEVELS[diagnostic.severity],
        "message": {"text": diagnostic.message + hint},
        "locations": [_location(diagnostic.primary)],
        "partialFingerprints": {FINGERPRINT: fingerprint},
    }
    if diagnostic.related:
        result["relatedLocations"] = [
            {**_location(label.span), "id": number, "message": {"text": label.message}}
            for number, label in enumerate(diagnostic.related, start=1)
        ]
    return result


def _location(span: Span) -> dict[str, Any]:
    return {
        "physicalLocation": {
            "artifactLocation": {"uri": _uri(span.file.path)},
            "region": {
                "startLine": span.line,
                "startColumn": span.column,
                "endColumn": span.column + span.length,
            },
        }
    }


def _uri(path: str) -> str:
    """Return the path as a URI reference; a relative path stays relative to the checkout."""
    quoted = quote(path.encode("utf-8", "surrogateescape"), safe="/")
    if PurePosixPath(path).is_absolute():
        return f"file://{quoted}"
    return quoted.removeprefix("./")
