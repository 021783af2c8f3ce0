"""Checks text as if it were a file, for the tests of rules."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from composer.base.diagnostics import Diagnostic
from composer.loading import load, load_bytes, load_files
from composer.loading.reported import LoadResult
from composer.model import System

#: The module of a node.
_MODULE = re.compile(r"""(?:class|behavior): ['"]?(\w+)(?=:)""")


def write_files(folder: Path, files: Mapping[str, str]) -> None:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def load_project(folder: Path, files: Mapping[str, str], **options: Any) -> LoadResult:
    """Write the files and load the first one, with the options of ``load``."""
    write_files(folder, files)
    return load(folder / next(iter(files)), **options)


def valid_system(folder: Path, files: Mapping[str, str], **options: Any) -> System:
    """Load a system that has nothing wrong in it from the first of the files."""
    result = load_project(folder, files, **options)
    assert [f"{item.primary}: {item.message}" for item in result.diagnostics] == []
    assert result.system is not None
    return result.system


def places(diagnostics: Iterable[Diagnostic]) -> list[str]:
    """Return where each diagnostic is and the name of its rule, as ``file:line:column rule``."""
    return [f"{item.primary} {item.rule.name}" for item in diagnostics]


def diagnostics_of_each(
    projects: Iterable[Mapping[str, str]], folder: Path
) -> list[list[Diagnostic]]:
    """Return the diagnostics of the first file of each project.

    All at once: the type checker starts once, which takes most of the time. It would start again
    for modules of the same name, so the module of a node gets the index of the project, such as
    ``code_0``. Each project is written to a folder that is named by its index.
    """
    paths = []
    for index, files in enumerate(projects):
        home = folder / str(index)
        write_files(home, _with_numbered_modules(files, index))
        paths.append(home / next(iter(files)))
    return [result.diagnostics for result in load_files(paths)]


def _with_numbered_modules(files: Mapping[str, str], number: int) -> dict[str, str]:
    modules = {Path(name).stem for name in files if name.endswith(".py")}

    def numbered(found: re.Match[str]) -> str:
        return f"{found[0]}_{number}" if found[1] in modules else found[0]

    used = {found[1] for text in files.values() for found in _MODULE.finditer(text)}
    return {
        name.replace(".py", f"_{number}.py") if Path(name).stem in used else name: _MODULE.sub(
            numbered, text
        )
        for name, text in files.items()
    }


def diagnostics_in(text: str, folder: Path) -> list[Diagnostic]:
    return load_bytes(text.encode(), folder, shown="system.yaml").diagnostics


def rules_broken(text: str, folder: Path) -> list[str]:
    """Return the names of the rules with diagnostics, sorted by location."""
    return [diagnostic.rule.name for diagnostic in diagnostics_in(text, folder)]


def quoted(diagnostic: Diagnostic) -> str:
    """Return the text at the location of a diagnostic."""
    span = diagnostic.primary
    return span.file.line(span.line)[span.column - 1 :][: span.length]
