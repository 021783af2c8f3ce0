"""Diagnostics for other programs: JSON, SARIF, and annotations of GitHub."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any
from urllib.parse import quote

from composer import DISTRIBUTION, version
from composer.base.characters import visible
from composer.base.diagnostics import Diagnostic, Rule, Severity
from composer.base.source import Span
from composer.report.rules import page_of

#: Incremented for every incompatible change of the JSON, ``schemas/report.schema.json``.
JSON_VERSION = 1
SARIF_SCHEMA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)
#: The version after the slash changes with the algorithm of the fingerprints.
FINGERPRINT = "composerDiagnostic/v1"

_SARIF_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}
_GITHUB_COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}


def render_json(diagnostics: Sequence[Diagnostic]) -> str:
    """Return the report as one JSON object, as described in ``schemas/report.schema.json``."""
    report = {
        "version": JSON_VERSION,
        "tool": {"name": DISTRIBUTION, "version": version()},
        "summary": {
            f"{severity.value}s": sum(item.severity is severity for item in diagnostics)
            for severity in Severity
        },
        "diagnostics": [
            _json_diagnostic(diagnostic, fingerprint)
            for diagnostic, fingerprint in zip(diagnostics, fingerprints(diagnostics), strict=True)
        ],
    }
    return json.dumps(report, indent=2) + "\n"


def _json_diagnostic(diagnostic: Diagnostic, fingerprint: str) -> dict[str, Any]:
    return {
        "code": diagnostic.rule.code,
        "rule": diagnostic.rule.name,
        "severity": diagnostic.severity.value,
        "message": diagnostic.message,
        "hint": diagnostic.hint,
        "location": _json_location(diagnostic.primary),
        "related": [
            {"message": label.message, "location": _json_location(label.span)}
            for label in diagnostic.related
        ],
        "fingerprint": fingerprint,
    }


def _json_location(span: Span) -> dict[str, Any]:
    return {
        "file": span.file.path,
        "line": span.line,
        "column": span.column,
        "end_column": span.column + span.length,
    }


def render_sarif(diagnostics: Sequence[Diagnostic]) -> str:
    """Return a SARIF log (2.1.0, OASIS) with one run, and every rule that has a diagnostic."""
    rules = sorted({item.rule for item in diagnostics}, key=lambda rule: rule.code)
    places = {rule.code: index for index, rule in enumerate(rules)}
    prints = fingerprints(diagnostics)
    run = {
        "tool": {
            "driver": {
                "name": DISTRIBUTION,
                "version": version(),
                "rules": [_sarif_rule(rule) for rule in rules],
            }
        },
        "columnKind": "unicodeCodePoints",
        "results": [
            _sarif_result(item, places[item.rule.code], fingerprint)
            for item, fingerprint in zip(diagnostics, prints, strict=True)
        ],
    }
    return json.dumps({"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2) + "\n"


def _sarif_rule(rule: Rule) -> dict[str, Any]:
    page = page_of(rule)
    return {
        "id": rule.code,
        "name": rule.name,
        "shortDescription": {"text": page.summary},
        "fullDescription": {"text": page.why},
        "help": {"text": f"{page.summary}\n\n{page.why}\n\nInstead:\n\n{page.good}"},
        "defaultConfiguration": {"level": _SARIF_LEVELS[rule.severity]},
    }


def _sarif_result(diagnostic: Diagnostic, rule_index: int, fingerprint: str) -> dict[str, Any]:
    hint = f"\n{diagnostic.hint}" if diagnostic.hint is not None else ""
    result: dict[str, Any] = {
        "ruleId": diagnostic.rule.code,
        "ruleIndex": rule_index,
        "level": _SARIF_LEVELS[diagnostic.severity],
        "message": {"text": diagnostic.message + hint},
        "locations": [_sarif_location(diagnostic.primary)],
        "partialFingerprints": {FINGERPRINT: fingerprint},
    }
    if diagnostic.related:
        result["relatedLocations"] = [
            {**_sarif_location(label.span), "id": number, "message": {"text": label.message}}
            for number, label in enumerate(diagnostic.related, start=1)
        ]
    return result


def _sarif_location(span: Span) -> dict[str, Any]:
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


def render_github(diagnostics: Iterable[Diagnostic]) -> str:
    """Return workflow commands, which GitHub Actions shows next to the changed lines."""
    return "".join(f"{_annotation(diagnostic)}\n" for diagnostic in diagnostics)


def _annotation(diagnostic: Diagnostic) -> str:
    span = diagnostic.primary
    properties = {
        "file": span.file.path,
        "line": str(span.line),
        "endLine": str(span.line),
        "col": str(span.column),
        "endColumn": str(span.column + span.length),
        "title": f"{diagnostic.rule.code} {diagnostic.rule.name}",
    }
    listed = ",".join(f"{key}={_escape_property(value)}" for key, value in properties.items())
    return f"::{_GITHUB_COMMANDS[diagnostic.severity]} {listed}::{_escape(_message(diagnostic))}"


def _message(diagnostic: Diagnostic) -> str:
    lines = [diagnostic.message]
    lines += [f"{label.span}: {label.message}" for label in diagnostic.related]
    if diagnostic.hint is not None:
        lines.append(f"hint: {diagnostic.hint}")
    return "\n".join(visible(line) for line in lines)


def _escape(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escape_property(text: str) -> str:
    return _escape(visible(text)).replace(":", "%3A").replace(",", "%2C")


def fingerprints(diagnostics: Iterable[Diagnostic]) -> list[str]:
    """Return a stable hexadecimal fingerprint for each diagnostic, in order.

    It is made from the rule, the file, the message and the line without its indentation, so added
    lines and other indentation do not change it. Diagnostics that are equal in all of these are
    numbered.
    """
    seen: Counter[tuple[str, ...]] = Counter()
    result = []
    for diagnostic in diagnostics:
        span = diagnostic.primary
        text = span.file.line(span.line).strip()
        facts = (diagnostic.rule.code, span.file.path, diagnostic.message, text)
        seen[facts] += 1
        content = "\0".join((*facts, str(seen[facts])))
        digest = hashlib.sha256(content.encode("utf-8", "surrogatepass"))
        result.append(digest.hexdigest()[:32])
    return result


#: By the name of the format.
RENDERERS: Mapping[str, Callable[[Sequence[Diagnostic]], str]] = {
    "json": render_json,
    "sarif": render_sarif,
    "github": render_github,
}
