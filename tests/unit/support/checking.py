"""Checks text as if it were a file, for the tests of rules."""

from __future__ import annotations

from pathlib import Path

from composer.base.diagnostics import Diagnostic
from composer.loading import load_bytes


def diagnostics_in(text: str, folder: Path) -> list[Diagnostic]:
    return load_bytes(text.encode(), folder, shown="system.yaml").diagnostics


def rules_broken(text: str, folder: Path) -> list[str]:
    """Return the names of the rules with diagnostics, sorted by location."""
    return [diagnostic.rule.name for diagnostic in diagnostics_in(text, folder)]


def quoted(diagnostic: Diagnostic) -> str:
    """Return the text at the location of a diagnostic."""
    span = diagnostic.primary
    return span.file.line(span.line)[span.column - 1 :][: span.length]
