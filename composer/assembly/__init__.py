"""What is written in several files made one tree: ``include`` and, of node types, ``extends``.

Every key and value keeps the place, and the file, where it was written.
"""

from __future__ import annotations

from collections.abc import Mapping as Map
from dataclasses import dataclass, field
from pathlib import Path

from composer.assembly.include_entries import IncludeReader
from composer.assembly.includes import IncludeResolver, system_file
from composer.assembly.inheritance import Inherited, NodeTypeFile, inherit
from composer.assembly.limits import IncludeLimits, LimitExceeded
from composer.assembly.rules import INCLUDE_CYCLE, INVALID_INCLUDE
from composer.diagnostics import Diagnostic
from composer.expand.rules import DUPLICATE_NODE_NAME, TOO_LARGE
from composer.project import Project
from composer.source import SourceFile, Span
from composer.tree import Mapping

__all__ = ["Assembly", "Inherited", "NodeTypeFile", "assemble", "inherit"]


#: What leaves nodes out, or gives them other names.
_LEAVING_OUT = (INVALID_INCLUDE, INCLUDE_CYCLE, DUPLICATE_NODE_NAME, TOO_LARGE)


@dataclass(frozen=True, slots=True)
class Assembly:
    """A system put together. ``tree`` is None when it says more than can be gone through.

    By what the files are called, ``folders`` are where they are, ``included`` where each was
    included. ``is_partial`` is true when nodes may be missing, or have other names than are meant,
    for reasons that are told.
    """

    tree: Mapping | None
    diagnostics: list[Diagnostic]
    is_partial: bool = False
    folders: Map[str, Path] = field(default_factory=dict)
    included: Map[str, tuple[Span, ...]] = field(default_factory=dict)


def assemble(tree: Mapping, source: SourceFile, folder: Path, project: Project) -> Assembly:
    """Return the system ``tree`` with its variables put in, its copies made, and all it includes.

    ``folder`` is where its file is; everything that is included is in ``project``. What is found
    wrong includes what the schema says of every file.
    """
    diagnostics: list[Diagnostic] = []
    limits = IncludeLimits()
    resolver = IncludeResolver(IncludeReader(project, limits, diagnostics), limits, diagnostics)
    try:
        whole = resolver.merge(system_file(tree, source, folder), {})
    except LimitExceeded as stopped:
        return Assembly(None, [stopped.diagnostic])
    is_partial = (
        resolver.is_partial
        or any(item.rule in _LEAVING_OUT for item in diagnostics)
        or _has_unmade_copies(whole)
    )
    return Assembly(whole, diagnostics, is_partial, resolver.folders, resolver.included)


def _has_unmade_copies(tree: Mapping) -> bool:
    nodes = tree.get("nodes")
    return isinstance(nodes, Mapping) and any("${" in entry.name for entry in nodes)
