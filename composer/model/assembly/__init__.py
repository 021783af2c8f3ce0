"""Merge several files into one tree: ``include`` of systems and ``extends`` of node types.

Every key and value keeps the file and location where it was written.
"""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping as Map
from dataclasses import field
from pathlib import Path
from types import MappingProxyType

from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span
from composer.language.rules import (
    CYCLE,
    DUPLICATE_NAME,
    TOO_LARGE,
    LimitedDiagnostics,
    Stopped,
    TooManyErrors,
)
from composer.language.tree import Entry, LeftOut, Mapping, entries, is_opaque
from composer.model.assembly.include_entries import IncludeReader, SystemFile
from composer.model.assembly.includes import IncludeResolver
from composer.model.assembly.inheritance import Inherited, NodeTypeFile, inherit, read_node_type
from composer.model.assembly.limits import INVALID_INCLUDE, SystemLimits
from composer.project import Project

__all__ = [
    "Inherited",
    "Merged",
    "NodeTypeFile",
    "assemble",
    "assemble_included",
    "inherit",
    "read_node_type",
]


#: Rules about nodes that are missing or have the wrong names.
_PARTIAL_RULES = (INVALID_INCLUDE, CYCLE, DUPLICATE_NAME, TOO_LARGE)


@dataclass(frozen=True, slots=True)
class Merged:
    """A file merged with what it includes or extends.

    ``tree`` is what ``compose config`` shows, ``expanded`` has values in place of variables; they
    are None for a file that exceeds a limit. ``folders`` are the folders of all files and
    ``included`` the places that include them, by file name. ``is_partial`` is true if nodes may be
    missing or misnamed because of errors in ``diagnostics``. ``left_out`` are entries that
    conditions leave out. ``values`` is the number of keys and values of all files, as written and
    as expanded. ``scenario`` is the file itself if it is a scenario; then the rest is about its
    system, whose file is ``source``.
    """

    tree: Mapping | None = None
    expanded: Mapping | None = None
    diagnostics: list[Diagnostic] = field(default_factory=list)
    folders: Map[str, Path] = field(default_factory=dict)
    included: Map[str, tuple[Span, ...]] = field(default_factory=dict)
    is_partial: bool = False
    left_out: tuple[LeftOut, ...] = ()
    values: int = 0
    scenario: Mapping | None = None
    source: SourceFile | None = None


def assemble(
    tree: Mapping,
    source: SourceFile,
    folder: Path,
    project: Project,
    arguments: Map[str, Entry] = MappingProxyType({}),
) -> Merged:
    """Return the system ``tree`` with its ``arguments`` expanded, merged with its includes.

    ``folder`` is the folder of its file; all included files must be in ``project``. Each file is
    checked against the schema.
    """
    file = SystemFile(folder / Path(source.path).name, source, tree)
    return _assembled(project, lambda resolver: (resolver.merge(file, dict(arguments)), source))


def assemble_included(
    include: Mapping, source: SourceFile, folder: Path, project: Project
) -> Merged:
    """Return the system that an entry of ``include`` in the file ``source`` names.

    It has the arguments and overrides of the entry, and its own namespace.
    """
    file = SystemFile(folder / Path(source.path).name, source, include)

    def merge(resolver: IncludeResolver) -> tuple[Mapping | None, SourceFile]:
        resolver.folders[source.path] = folder
        included = resolver.included_system(include, file)
        return (None, source) if included is None else (included.tree, included.file.source)

    return _assembled(project, merge)


def _assembled(
    project: Project, merge: Callable[[IncludeResolver], tuple[Mapping | None, SourceFile]]
) -> Merged:
    diagnostics = LimitedDiagnostics()
    limits = SystemLimits([])
    resolver = IncludeResolver(IncludeReader(project, limits, diagnostics), limits, diagnostics)
    try:
        merged, source = merge(resolver)
    except TooManyErrors as stopped:
        return Merged(diagnostics=stopped.diagnostics)
    except Stopped as stopped:
        return Merged(diagnostics=[stopped.diagnostic])
    if merged is None:
        return Merged(diagnostics=diagnostics)
    is_partial = (
        resolver.is_partial
        or any(item.rule in _PARTIAL_RULES for item in diagnostics)
        or any(is_opaque(entry.name) for entry in entries(merged.get("nodes")))
    )
    included = {path: tuple(places.values()) for path, places in resolver.included.items()}
    return Merged(
        merged,
        merged,
        diagnostics,
        resolver.folders,
        included,
        is_partial,
        resolver.left_out,
        resolver.values,
        source=source,
    )
