"""LoadResult a text as if it were a file, for the tests of checks."""

from __future__ import annotations

from pathlib import Path

from composer.diagnostics import Diagnostic
from composer.loading import load_bytes


def findings_in(text: str, folder: Path) -> list[Diagnostic]:
    return load_bytes(text.encode(), folder, shown="system.yaml").diagnostics


def rules_broken(text: str, folder: Path) -> list[str]:
    """Return the names of the rules that find something, in the order of the places."""
    return [finding.rule.name for finding in findings_in(text, folder)]


def quoted(finding: Diagnostic) -> str:
    """Return what the file says at the place of a finding."""
    span = finding.primary
    return span.file.line(span.line)[span.column - 1 :][: span.length]
