"""Load node types: read each file once, and instantiate it with the variables of each node."""

from __future__ import annotations

from dataclasses import field
from pathlib import Path

from composer.base.diagnostics import Diagnostic, has_errors, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language.expand import expand, missing_values
from composer.language.schema import NODE, check_schema
from composer.language.tree import Entry, Mapping, Plain, Tree, entries, plain
from composer.model.assembly import Inherited, inherit, read_node_type
from composer.model.resolve.declaration import Declaration, declare
from composer.model.resolve.qos import QosTable
from composer.project.node_types import SourceFolders


@dataclass(frozen=True, slots=True)
class DeclaredNode:
    """What an inline node declares, or a node type with the variables of a node.

    ``complete`` is false if the file of the type has errors, so that declarations may be missing.
    ``files`` are its own file and the files of the types that it extends.
    """

    tree: Mapping
    folders: SourceFolders
    declaration: Declaration
    complete: bool = True
    files: tuple[Path, ...] = ()


@dataclass(slots=True)
class NodeTypeLoader:
    """Loads the node types of a system, and adds diagnostics in their files."""

    folders: SourceFolders
    qos: QosTable
    diagnostics: list[Diagnostic]
    _found: dict[tuple[Path, str], Path | None] = field(default_factory=dict)
    _read: dict[Path, Inherited | None] = field(default_factory=dict)
    _without_variables: dict[Path, DeclaredNode | None] = field(default_factory=dict)
    _shapes: set[tuple[Path, str]] = field(default_factory=set)

    def find(self, name: Located[str]) -> Path | None:
        """Return the file of the node type ``name`` for the file that refers to it, or None."""
        known = (self.folders.folder(name.span), name.value)
        if known not in self._found:
            self._found[known] = self.folders.node_types_for(name.span).find(name.value)
        return self._found[known]

    def declare(self, tree: Mapping, folders: SourceFolders | None = None) -> Declaration:
        """Read the declaration of a node; ``folders`` belong to its type, if it has one."""
        return declare(tree, folders or self.folders, self.qos, self.diagnostics)

    def instantiate(self, path: Path, variables: Tree | None, span: Span) -> DeclaredNode | None:
        """Return the type in the file ``path`` with ``variables``; None if it cannot be read.

        ``span`` is the reference to the type.
        """
        written = self._document(path)
        if written is None or written.tree is None:
            return None
        given = {entry.name: entry for entry in entries(variables)}
        if variables is None or isinstance(variables, Mapping):
            named = written.tree.get("node")
            owner = f"node type '{'' if named is None else shown(str(plain(named)))}'"
            self.diagnostics.extend(missing_values(written.tree, given, span, owner, "node"))
        if given:
            # Not shared: values of arguments have the location of the argument.
            return self._instantiate(path, written, written.tree, given)
        if path not in self._without_variables:
            self._without_variables[path] = self._instantiate(path, written, written.tree, {})
        return self._without_variables[path]

    def _instantiate(
        self, path: Path, written: Inherited, tree: Mapping, given: dict[str, Entry]
    ) -> DeclaredNode:
        expanded, found, *_ = expand(tree, given)
        found = [*found, *self._schema_diagnostics(path, expanded, given)]
        folders = SourceFolders(path.parent, written.folders, self.folders.node_types)
        declaration = declare(expanded, folders, self.qos, found)
        self.diagnostics.extend(found)
        files = tuple(file.path for file in written.files)
        return DeclaredNode(expanded, folders, declaration, not has_errors(found), files)

    def _schema_diagnostics(
        self, path: Path, expanded: Mapping, given: dict[str, Entry]
    ) -> list[Diagnostic]:
        """Check a type against the schema, unless it passed with the same values before."""
        values: dict[str, Plain] = {name: plain(entry.value) for name, entry in given.items()}
        shape = (path, repr(values))
        if shape in self._shapes:
            return []
        found = check_schema(expanded, NODE)
        if not found:
            self._shapes.add(shape)
        return found

    def _document(self, path: Path) -> Inherited | None:
        if path not in self._read:
            self._read[path] = self._read_file(path)
        return self._read[path]

    def _read_file(self, path: Path) -> Inherited | None:
        file = read_node_type(path, self.diagnostics)
        if file is None:
            return None
        inherited = inherit(file)
        self.diagnostics.extend(inherited.diagnostics)
        return inherited
