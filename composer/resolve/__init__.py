"""From the expanded tree to the model.

Resolving is total and lenient: it never raises on a tree that came out of ``document``, takes what
has the right shape and leaves out the rest, so that one run can show every finding. It judges
nothing but expressions and templates: a name that refers to nothing stays in the model as it was
written, and the checks say what is wrong with it.
"""

from __future__ import annotations

from pathlib import Path

from composer.catalog import Catalog
from composer.diagnostics import Diagnostic, in_order
from composer.model import System
from composer.resolve import kinds
from composer.resolve.kinds import check_kind
from composer.resolve.overrides import Overrides, read_overrides
from composer.resolve.system import resolve_node_type, resolve_system
from composer.schema import kind_of
from composer.source import SourceFile
from composer.tree import Mapping

__all__ = ["Overrides", "check_kind", "read_overrides", "resolve"]


def resolve(
    tree: Mapping,
    source: SourceFile,
    catalog: Catalog,
    *,
    folder: Path | None = None,
    overrides: Overrides | None = None,
) -> tuple[System | None, list[Diagnostic]]:
    """Return the model of a file, and what is wrong with its expressions and its node types.

    ``tree`` has its load-time variables filled in; ``folder`` is where its behaviours are looked
    for first (the folder of ``source.path`` unless given). A node type gives a system of that one
    node; a file that is neither gives no system and a finding.
    """
    place = folder if folder is not None else Path(source.path).parent
    extra = overrides if overrides is not None else Overrides()
    match kind_of(tree):
        case kinds.SYSTEM:
            system, findings = resolve_system(tree, source, place, catalog, extra)
        case kinds.NODE:
            system, findings = resolve_node_type(tree, source, place, extra)
        case _:
            wrong = check_kind(tree, source)
            return None, [wrong] if wrong is not None else []
    return system, in_order(findings)
