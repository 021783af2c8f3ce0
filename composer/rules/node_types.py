"""Node types and their files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path, PurePath

from composer.base.diagnostics import Diagnostic, error, suggestion, warning
from composer.base.source import Located, shown_path
from composer.language.rules import UNUSED_DECLARATION
from composer.language.tree_values import is_opaque
from composer.model import System
from composer.project import SETTINGS_FILE, Project
from composer.project.node_types import replaced_built_in_type
from composer.rules.analysis.context import Context, is_unresolved, location

UNKNOWN_NODE_TYPE = error("RC201", "unknown-node-type")
REPLACED_NODE_TYPE = warning("RC214", "replaced-node-type")
NODE_TYPE_NAME = warning("RC215", "node-type-name")


def check_unknown_node_type(context: Context) -> Iterator[Diagnostic]:
    """Check the type of every node that names one."""
    for node in context.system.nodes:
        name = node.type_name
        if name is None or node.type_found or is_unresolved(name.value):
            continue
        if context.node_types.find(name.value) is not None:
            continue  # the file exists but is invalid, which is reported elsewhere
        if context.node_types.find_outside_project(name.value) is not None:
            message = f"the file of node type '{name}' is a symbolic link out of the project"
            yield Diagnostic(
                UNKNOWN_NODE_TYPE, message, name.span, hint="copy the target into the project"
            )
            continue
        yield Diagnostic(
            UNKNOWN_NODE_TYPE,
            f"node '{node.name}' has type '{name}', which does not exist",
            name.span,
            hint=suggestion(name.value, context.node_types.names()),
            relies_on=(("folder", "nodes"),),
        )


def check_replaced_node_type(context: Context) -> Iterator[Diagnostic]:
    """Check the file of every node type, once."""
    seen = set()
    for node in context.system.nodes:
        if node.type_name is None or not node.type_files or node.type_files[0] in seen:
            continue
        path = node.type_files[0]
        seen.add(path)
        if replaced_built_in_type(path) is None:
            continue
        project = Project.at(path.parent)
        if not project.is_declared:
            yield Diagnostic(
                REPLACED_NODE_TYPE,
                f"'{shown_path(path)}' replaces the built-in node type '{node.type_name}'",
                node.type_name.span,
                hint=f"rename it, or create {shown_path(project.root / SETTINGS_FILE)}, which"
                " declares the project",
            )


_SUFFIXES = frozenset({".yaml", ".yml"})


def check_node_type_name(context: Context) -> Iterator[Diagnostic]:
    """Compare the names of a node type, and of those of nodes, with the names of their files."""
    system = context.system
    if system.node_type:
        yield from _compare_with_file(system.name)
    names = (node.own_type_name for node in system.nodes)
    places = {location(name.span): name for name in names if name is not None}
    for name in places.values():
        yield from _compare_with_file(name)


def _compare_with_file(name: Located[str]) -> Iterator[Diagnostic]:
    file = PurePath(name.span.file.path)
    if file.suffix in _SUFFIXES and file.stem != name.value and not is_unresolved(name.value):
        yield Diagnostic(
            NODE_TYPE_NAME,
            f"node type '{name}' is in a file named '{file.name}'",
            name.span,
            hint=f"write 'node: {file.stem}', or rename the file to '{name}{file.suffix}'",
        )


def unused_node_types(loaded: Iterable[System]) -> Iterator[Diagnostic]:
    """Check all systems and node types of a run together."""
    node_types: list[System] = []
    systems: list[System] = []
    for system in loaded:
        (node_types if system.node_type else systems).append(system)
    used = {
        path.resolve() for system in systems for node in system.nodes for path in node.type_files
    }
    for node_type in node_types if systems else ():
        is_unused = Path(node_type.source.path).resolve() not in used
        if is_unused and not is_opaque(node_type.name.value):
            message = f"no system here uses node type '{node_type.name}'"
            yield Diagnostic(UNUSED_DECLARATION, message, node_type.name.span)
