"""Checks many Python texts at once: the type checker starts once, which takes most of the time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from composer.base.diagnostics import Diagnostic
from composer.loading import load_files


def diagnostics_of(system: str, codes: Sequence[str], folder: Path) -> list[list[Diagnostic]]:
    """Return the diagnostics of each text, as module ``code`` of the same system."""
    paths = []
    for index, code in enumerate(codes):
        home = folder / str(index)
        home.mkdir()
        name = f"code_{index}"
        (home / f"{name}.py").write_text(code, encoding="utf-8")
        path = home / "system.yaml"
        path.write_text(system.replace(" code:", f" {name}:"), encoding="utf-8")
        paths.append(path)
    return [result.diagnostics for result in load_files(paths)]
