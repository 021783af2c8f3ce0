"""A node type of the project that none of its systems uses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from composer.catalog import Catalog
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import System

RULE = register(
    Rule(
        code="RC244",
        name="unused-node-type",
        severity=Severity.INFO,
        summary="No system that was looked at uses a node type that was looked at.",
        why=(
            "It is left over, or a system that was meant to use it uses another one. It is told "
            "only when systems and node types are validated together."
        ),
        bad="""\
nodes/planner.yaml
nodes/old_planner.yaml
systems/pipeline.yaml    # uses planner only
""",
        good="""\
nodes/planner.yaml
systems/pipeline.yaml    # uses planner
""",
    )
)


def unused_node_types(project: Iterable[tuple[System, Catalog]]) -> Iterator[Diagnostic]:
    """Look at all systems and node types of a run together, each with what it could refer to."""
    loaded = list(project)
    systems = [(system, catalog) for system, catalog in loaded if not system.node_type]
    if not systems:
        return
    used = {path for system, catalog in systems for path in _used(system, catalog)}
    for node_type, _ in loaded:
        if node_type.node_type and Path(node_type.source.path).resolve() not in used:
            message = f"no system here uses node type '{node_type.name}'"
            yield Diagnostic(RULE, message, node_type.name.span)


def _used(system: System, catalog: Catalog) -> Iterator[Path]:
    names = {node.type_name.value for node in system.nodes if node.type_name is not None}
    for name in names:
        path = catalog.find(name)
        if path is not None:
            yield path.resolve()
