"""From the expanded tree to the model.

Resolving is total and lenient: it never raises on a tree that came out of ``document``, takes what
has the right shape and leaves out the rest, so that one run can show every finding. It judges
nothing but expressions and templates: a name that refers to nothing stays in the model as it was
written, and the checks say what is wrong with it.
"""

from __future__ import annotations

from collections.abc import Mapping as Map
from pathlib import Path
from types import MappingProxyType

from composer.catalog import Catalog
from composer.diagnostics import Diagnostic, in_order
from composer.model import System
from composer.resolve.files import Places
from composer.resolve.overrides import NOTHING_SAID, CommandLine, Overrides, read_overrides
from composer.resolve.system import resolve_node_type, resolve_system
from composer.schema import kind_of, kinds
from composer.schema.kinds import check_kind
from composer.source import SourceFile
from composer.tree import Mapping

__all__ = ["NOTHING_SAID", "CommandLine", "Overrides", "read_overrides", "resolve"]


def resolve(
    tree: Mapping,
    source: SourceFile,
    catalog: Catalog,
    *,
    folders: Map[str, Path] = MappingProxyType({}),
    overrides: Overrides | None = None,
) -> tuple[System | None, list[Diagnostic]]:
    """Return the model of a file, and what is wrong with its expressions and its node types.

    ``tree`` has its load-time variables filled in; ``folders`` are those of the files that it was
    put together from, by what they are called (the folder of ``source.path`` unless given): there
    behaviours are looked for first. A node type gives a system of that one
    node; a file that is neither gives no system and a finding.
    """
    home = folders.get(source.path, Path(source.path).parent)
    places = Places(home, folders, catalog)
    extra = overrides if overrides is not None else Overrides()
    match kind_of(tree):
        case kinds.SYSTEM:
            system, findings = resolve_system(tree, source, places, extra)
        case kinds.NODE:
            system, findings = resolve_node_type(tree, source, places, extra)
        case _:
            wrong = check_kind(tree, source)
            return None, [wrong] if wrong is not None else []
    return system, in_order(findings)
