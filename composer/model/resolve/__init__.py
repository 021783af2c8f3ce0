"""Resolve an expanded tree into the model.

This never fails: it uses what has the right type and skips the rest, so that one run can show every
diagnostic. It reports errors in expressions and templates only. Unknown names stay in the model as
written, and the rules report them.
"""

from __future__ import annotations

from collections.abc import Mapping as Map
from pathlib import Path
from types import MappingProxyType

from composer.base.diagnostics import Diagnostic, in_order
from composer.base.source import SourceFile
from composer.language import schema
from composer.language.rules import TooManyErrors
from composer.language.schema import check_kind, kind_of
from composer.language.tree import Mapping
from composer.model import System
from composer.model.resolve.overrides import (
    NO_OVERRIDES,
    OverrideOptions,
    Overrides,
    read_overrides,
)
from composer.model.resolve.system import resolve_node_type, resolve_system
from composer.project.node_types import NodeTypes, SourceFolders

__all__ = ["NO_OVERRIDES", "OverrideOptions", "Overrides", "read_overrides", "resolve"]


def resolve(
    tree: Mapping,
    source: SourceFile,
    node_types: NodeTypes,
    *,
    folders: Map[str, Path] = MappingProxyType({}),
    overrides: Overrides | None = None,
) -> tuple[System | None, list[Diagnostic]]:
    """Return the model of a file, with diagnostics of its expressions and its node types.

    ``tree`` has its arguments expanded. ``folders`` are the folders of its files by file name (by
    default, the folder of ``source.path``), where behaviors are searched first. A node
    type gives a system with one node; a file that is neither gives no system and a diagnostic.
    """
    home = folders.get(source.path, Path(source.path).parent)
    source_folders = SourceFolders(home, folders, node_types)
    extra = overrides if overrides is not None else Overrides()
    try:
        match kind_of(tree):
            case schema.SYSTEM:
                system, diagnostics = resolve_system(tree, source, source_folders, extra)
            case schema.NODE:
                system, diagnostics = resolve_node_type(tree, source, source_folders, extra)
            case _:
                wrong = check_kind(tree, source)
                return None, [wrong] if wrong is not None else []
    except TooManyErrors as stopped:
        return None, in_order(stopped.diagnostics)
    return system, in_order(diagnostics)
