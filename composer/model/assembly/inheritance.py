"""Merge a node type with the types that it extends."""

from __future__ import annotations

from collections.abc import Mapping as Map
from dataclasses import replace
from pathlib import Path

from composer.base.diagnostics import Diagnostic, Label, shown, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, SourceFile
from composer.language.document import read_document
from composer.language.rules import CYCLE, MAX_INCLUDE_DEPTH, Stopped
from composer.language.schema import NODE, check_kind, with_intended_sections
from composer.language.tree import Mapping, count_values, text
from composer.model.assembly.limits import UNKNOWN_BASE, SystemLimits, exceeded
from composer.model.assembly.merging import merge_maps
from composer.project import Project
from composer.project.node_types import NodeTypes

EXTENDS = "extends"


@dataclass(frozen=True, slots=True)
class NodeTypeFile:
    """The file of a node type."""

    path: Path
    source: SourceFile
    tree: Mapping

    @property
    def base(self) -> Located[str] | None:
        """The type that it extends; None if there is none, or if it is not a text."""
        return text(self.tree.get(EXTENDS))


@dataclass(frozen=True, slots=True)
class Inherited:
    """A node type merged with its base types, and their files, its own first.

    ``tree`` is None if a base type cannot be found or read.
    """

    tree: Mapping | None
    diagnostics: list[Diagnostic]
    files: tuple[NodeTypeFile, ...]

    @property
    def folders(self) -> Map[str, Path]:
        """The folders of the files, by file name."""
        return {file.source.path: file.path.parent for file in self.files}


def read_node_type(path: Path, diagnostics: list[Diagnostic]) -> NodeTypeFile | None:
    """Return the file at ``path``; None if it cannot be read, or is no node type."""
    tree, source, found = read_document(path)
    diagnostics += found
    wrong_kind = None if tree is None else check_kind(tree, source, (NODE,))
    if wrong_kind is not None:
        diagnostics.append(wrong_kind)
    return None if tree is None or wrong_kind else NodeTypeFile(path, source, tree)


def inherit(file: NodeTypeFile) -> Inherited:
    """Return the node type in ``file`` merged with the types that it extends.

    Variables are not expanded yet: a type may override the variables of its base.
    """
    diagnostics: list[Diagnostic] = []
    files = [_with_intended_sections(file, diagnostics)]
    limits = SystemLimits([])
    try:
        while (name := files[-1].base) is not None:
            base = _base(name, files, limits, diagnostics)
            if base is None:
                return Inherited(None, diagnostics, tuple(files))
            files.append(_with_intended_sections(base, diagnostics))
    except Stopped as stopped:
        return Inherited(None, [stopped.diagnostic], tuple(files))
    tree = files[-1].tree
    for child in reversed(files[:-1]):
        own = (entry for entry in child.tree if entry.name != EXTENDS)
        tree = merge_maps(tree, Mapping(tuple(own), child.tree.span))
    return Inherited(tree, diagnostics, tuple(files))


def _with_intended_sections(file: NodeTypeFile, diagnostics: list[Diagnostic]) -> NodeTypeFile:
    tree, found = with_intended_sections(file.tree, NODE)
    diagnostics += found
    return replace(file, tree=tree)


def _base(
    name: Located[str],
    files: list[NodeTypeFile],
    limits: SystemLimits,
    diagnostics: list[Diagnostic],
) -> NodeTypeFile | None:
    """Return the file of the type ``name`` that the last of ``files`` extends."""
    node_types = NodeTypes.of(Project.at(files[-1].path.parent))
    path = node_types.find(name.value)
    if path is None:
        message = f"there is no node type '{shown(name.value)}' to extend"
        hint = suggestion(name.value, node_types.names())
        diagnostics.append(Diagnostic(UNKNOWN_BASE, message, name.span, hint=hint))
        return None
    known = [number for number, file in enumerate(files) if file.path.resolve() == path.resolve()]
    if known:
        diagnostics.append(_cycle(files[known[0] :]))
        return None
    if len(files) > MAX_INCLUDE_DEPTH:
        message = f"node types extend each other more than {MAX_INCLUDE_DEPTH} deep"
        raise exceeded(message, name.span, "extend the base type directly")
    file = read_node_type(path, diagnostics)
    if file is not None:
        limits.count("characters", len(file.source.text), name.span)
        limits.count("values", count_values(file.tree), name.span)
    return file


def _cycle(files: list[NodeTypeFile]) -> Diagnostic:
    """Report a cycle, starting at its first file by name: one diagnostic for all entry points."""
    paths = [file.source.path for file in files]
    first = paths.index(min(paths))
    files = files[first:] + files[:first]
    names = [shown(file.path.stem) for file in files]
    cycle = " -> ".join([*names, names[0]])
    spans = [file.base.span for file in files if file.base is not None]
    labels = tuple(Label(span, "through this") for span in spans[1:])
    through = f": {cycle}" if len(files) > 1 else ""
    message = f"node type '{names[0]}' extends itself{through}"
    return Diagnostic(CYCLE, message, spans[0], labels)
