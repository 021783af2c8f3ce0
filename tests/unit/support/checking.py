"""Checks text as if it were a file, for the tests of rules."""

from __future__ import annotations

from pathlib import Path

from composer.base.diagnostics import Diagnostic
from composer.loading import load, load_bytes

#: The rules that are broken, each with the name of the file and the line.
Places = list[tuple[str, str, int]]


def diagnostics_in(text: str, folder: Path) -> list[Diagnostic]:
    return load_bytes(text.encode(), folder, shown="system.yaml").diagnostics


def rules_broken(text: str, folder: Path) -> list[str]:
    """Return the names of the rules with diagnostics, sorted by location."""
    return [diagnostic.rule.name for diagnostic in diagnostics_in(text, folder)]


def places_in(files: dict[str, str], folder: Path) -> Places:
    """Write files, one of them ``system.yaml``, and return the mistakes in it, without infos."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    return [
        (item.rule.name, Path(item.primary.file.path).name, item.primary.line)
        for item in load(folder / "system.yaml").diagnostics
        if item.severity.value != "info"
    ]


def quoted(diagnostic: Diagnostic) -> str:
    """Return the text at the location of a diagnostic."""
    span = diagnostic.primary
    return span.file.line(span.line)[span.column - 1 :][: span.length]
