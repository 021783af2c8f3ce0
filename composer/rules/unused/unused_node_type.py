"""A node type that no system uses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from composer.diagnostics import Diagnostic, info
from composer.model import System
from composer.resolve.tree_values import is_opaque

RULE = info(
    code="RC244",
    name="unused-node-type",
    summary="No validated system uses a validated node type.",
    why=(
        "The node type is left over, or a system uses another one instead. Reported only if "
        "systems and node types are validated together."
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
            yield Diagnostic(RULE, message, node_type.name.span)
