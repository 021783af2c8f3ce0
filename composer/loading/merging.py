"""Files before they become models: read, merged with what they include or extend, and expanded."""

from __future__ import annotations

import os
from collections.abc import Mapping as Map
from dataclasses import replace
from itertools import chain
from pathlib import Path

from composer.base.diagnostics import Diagnostic, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile
from composer.interfaces import Interfaces
from composer.language import schema
from composer.language.document import read_document
from composer.language.expand import expand
from composer.language.rules import MAX_ENTRIES, MAX_NODES, TOO_LARGE
from composer.language.schema import check_kind, check_schema, kind_of, with_intended_sections
from composer.language.tree import Entry, Mapping, Scalar, Tree, entries
from composer.language.tree import Sequence as ListTree
from composer.model.assembly import (
    Merged,
    NodeTypeFile,
    assemble,
    assemble_included,
    inherit,
)
from composer.project import SETTINGS_FILE, SYSTEMS, Project
from composer.project.node_types import NodeTypes, interface_folders


@dataclass(frozen=True, slots=True)
class Document:
    """A file as a located tree."""

    tree: Mapping | None
    source: SourceFile
    diagnostics: list[Diagnostic]


@dataclass(frozen=True, slots=True)
class Definitions:
    """The node types and interfaces that files in ``folder`` may refer to."""

    folder: Path
    project: Project
    node_types: NodeTypes
    interfaces: Interfaces

    @classmethod
    def of(cls, folder: Path, interfaces: Interfaces | None) -> Definitions:
        """Return the definitions. Interfaces are read unless they are given."""
        project = Project.at(folder)
        if interfaces is None:
            interfaces = Interfaces.load(interface_folders(project))
        return cls(folder, project, NodeTypes.of(project), interfaces)

    @classmethod
    def with_shared_interfaces(
        cls, folder: Path, shared: dict[tuple[Path, ...], Interfaces]
    ) -> Definitions:
        """Return the definitions, with interfaces that other folders of the project share."""
        project = Project.at(folder)
        folders = interface_folders(project)
        if folders not in shared:
            shared[folders] = Interfaces.load(folders)
        return cls(folder, project, NodeTypes.of(project), shared[folders])


def read(path: Path, shown: str | None = None) -> Document:
    """Return a file as a tree; ``shown`` is its name in diagnostics."""
    tree, source, diagnostics = read_document(path, shown)
    if path.name == SETTINGS_FILE:  # the project reports its diagnostics
        tree, diagnostics = None, []
    return Document(tree, source, diagnostics)


def real_folder(path: Path) -> Path:
    """Return the folder of a file; of a symbolic link, the folder of its target."""
    try:
        return path.resolve().parent
    except (OSError, RuntimeError, ValueError):  # reported when the file is read
        return Path.cwd()


def merge(document: Document, definitions: Definitions, arguments: Map[str, Entry]) -> Merged:
    """Return a file with what it includes or extends, and its ``arguments`` in place."""
    tree = document.tree
    if not tree:
        return Merged()
    match kind_of(tree):
        case schema.SYSTEM | schema.NODE if (surplus := _surplus_entry(tree)) is not None:
            return Merged(diagnostics=[surplus])
        case schema.SYSTEM:
            return _within_limits(
                assemble(tree, document.source, definitions.folder, definitions.project, arguments)
            )
        case schema.NODE:
            return _merge_node_type(tree, document.source, definitions, arguments)
        case schema.SCENARIO:
            return _merge_scenario(tree, document.source, definitions)
        case _:
            problem = check_kind(tree, document.source)
            return Merged(diagnostics=[] if problem is None else [problem])


def _within_limits(merged: Merged) -> Merged:
    """Return a system; only its diagnostics if one of its sections has too many entries."""
    surplus = None if merged.tree is None else _surplus_entry(merged.tree)
    return merged if surplus is None else Merged(diagnostics=[*merged.diagnostics, surplus])


def _merge_scenario(tree: Mapping, source: SourceFile, definitions: Definitions) -> Merged:
    """Return the system of a scenario, with its arguments and overrides, as if it included it."""
    tree, diagnostics = with_intended_sections(tree, schema.SCENARIO)
    arguments = tuple(entry for entry in tree if entry.name == "arguments")
    others = tuple(entry for entry in tree if entry.name != "arguments")
    expanded, found, *_ = expand(Mapping(others, tree.span), {})  # a scenario declares no names
    tree = Mapping((*expanded, *arguments), tree.span)
    diagnostics += [*found, *check_schema(tree, schema.SCENARIO)]
    project, folder = definitions.project, definitions.folder
    keys = [entry for entry in tree if entry.name in ("arguments", "overrides")]
    file = tree.entry(schema.SYSTEM)
    if file is None:
        return Merged(diagnostics=diagnostics)
    named = Entry(Scalar("file", file.key.span), _system_path(file.value, folder, project))
    include = Mapping((named, *keys), tree.span)
    merged = _within_limits(assemble_included(include, source, folder, project))
    return replace(merged, diagnostics=[*diagnostics, *merged.diagnostics], scenario=tree)


def _system_path(name: Tree, folder: Path, project: Project) -> Tree:
    """Return the path of a system of the project that is given by its name."""
    if not isinstance(name, Scalar) or not isinstance(name.value, str):
        return name
    if "/" in name.value or name.value.endswith((".yaml", ".yml")):
        return name
    path = project.root / SYSTEMS / f"{name.value}.yaml"
    return Scalar(os.path.relpath(path, folder), name.span, verbatim=False)


def _surplus_entry(tree: Mapping) -> Diagnostic | None:
    """Return the diagnostic for a section of a file, or of one of its nodes, with many entries."""
    inner = [section for node in entries(tree.get("nodes")) for section in entries(node.value)]
    frames = (part for item in inner if item.name == "transforms" for part in entries(item.value))
    for section in chain(tree, inner, frames):
        limit = MAX_NODES if section.name == "nodes" else MAX_ENTRIES
        match section.value:
            case Mapping(entries=own) if len(own) > limit:
                span = own[limit].key.span
            case ListTree(items=items) if len(items) > limit:
                span = items[limit].span
            case _:
                continue
        message = f"'{shown(section.name)}' has more than {limit:,} entries"
        return Diagnostic(TOO_LARGE, message, span)
    return None


def _merge_node_type(
    tree: Mapping, source: SourceFile, definitions: Definitions, arguments: Map[str, Entry]
) -> Merged:
    file = NodeTypeFile(definitions.folder / Path(source.path).name, source, tree)
    inherited = inherit(file)
    if inherited.tree is None:
        return Merged(diagnostics=inherited.diagnostics)
    expanded, found, *_ = expand(inherited.tree, arguments)
    diagnostics = [*inherited.diagnostics, *found, *check_schema(expanded, schema.NODE)]
    return Merged(inherited.tree, expanded, diagnostics, inherited.folders)
