"""Node types: their files are read once, and declared once for every set of variables."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from composer.catalog import Catalog, shown_path
from composer.diagnostics import Diagnostic, has_errors
from composer.document import read_document
from composer.expand import expand
from composer.resolve.declaration import Declaration, declare
from composer.resolve.kinds import NODE, check_kind
from composer.resolve.qos import QosTable
from composer.resolve.reading import entries
from composer.schema import check_schema
from composer.tree import Mapping, Plain, Tree, plain


@dataclass(frozen=True, slots=True)
class NodeType:
    """A node type made with the variables of an instance.

    ``complete`` is false when its file has errors, so that what it declares may not be all.
    """

    tree: Mapping
    folder: Path
    declaration: Declaration
    complete: bool


@dataclass(slots=True)
class NodeTypes:
    """The node types a system uses. Findings in their files are added to ``findings``."""

    catalog: Catalog
    qos: QosTable
    findings: list[Diagnostic]
    _found: dict[str, Path | None] = field(default_factory=dict)
    _read: dict[Path, Mapping | None] = field(default_factory=dict)
    _made: dict[tuple[Path, str], NodeType | None] = field(default_factory=dict)

    def find(self, name: str) -> Path | None:
        """Return the file of the node type called ``name``, or None."""
        if name not in self._found:
            self._found[name] = self.catalog.find(name)
        return self._found[name]

    def make(self, path: Path, variables: Tree | None) -> NodeType | None:
        """Return the type in the file ``path`` made with ``variables``, or None.

        None stands for a file that cannot be read as a node type; the findings say why.
        """
        given = {entry.name: entry.value for entry in entries(variables)}
        values: dict[str, Plain] = {name: plain(value) for name, value in given.items()}
        made = (path, repr(values))
        if made not in self._made:
            self._made[made] = self._make(path, given)
        return self._made[made]

    def _make(self, path: Path, given: dict[str, Tree]) -> NodeType | None:
        tree = self._document(path)
        if tree is None:
            return None
        expanded, found = expand(tree, given)
        found = [*found, *check_schema(expanded, NODE)]
        declaration = declare(expanded, path.parent, self.qos, found)
        self.findings.extend(found)
        return NodeType(expanded, path.parent, declaration, complete=not has_errors(found))

    def _document(self, path: Path) -> Mapping | None:
        if path not in self._read:
            self._read[path] = self._read_file(path)
        return self._read[path]

    def _read_file(self, path: Path) -> Mapping | None:
        tree, source, found = read_document(path, shown_path(path))
        self.findings.extend(found)
        if tree is None:
            return None
        wrong_kind = check_kind(tree, source, (NODE,))
        if wrong_kind is not None:
            self.findings.append(wrong_kind)
            return None
        return tree
