"""A cycle of dependencies between nodes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, error
from composer.model import Dependency, System
from composer.model.dependencies import dependency_cycles

RULE = error(
    code="RC401",
    name="dependency-cycle",
    summary="Nodes depend on each other in a cycle.",
    why="None of them can start first.",
    bad="""\
system: cycle
nodes:
  planner: {lifecycle: {depends_on: [mapper]}}
  mapper: {lifecycle: {depends_on: [planner]}}
""",
    good="""\
system: cycle
nodes:
  planner: {lifecycle: {depends_on: [mapper]}}
  mapper: {on_activate: {log: ready}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report one cycle for every group of nodes that depend on each other."""
    for cycle in dependency_cycles(context.system):
        pairs = list(zip(cycle, (*cycle[1:], cycle[0]), strict=True))
        steps = [(_dependency(context.system, *pair), *pair) for pair in pairs]
        path = " -> ".join((*cycle, cycle[0]))
        message = (
            f"node '{cycle[0]}' depends on itself"
            if len(cycle) == 1
            else f"nodes depend on each other in a cycle: {path}"
        )
        yield Diagnostic(
            RULE,
            message,
            steps[0][0].node.span,
            tuple(
                Label(dependency.node.span, f"'{name}' depends on '{other}'")
                for dependency, name, other in steps[1:]
            ),
            "remove the dependency" if len(cycle) == 1 else "remove one of the dependencies",
        )


def _dependency(system: System, name: str, other: str) -> Dependency:
    node = system.node(name)
    found = node.depends_on if node is not None else ()
    return next(item for item in found if item.node.value == other)
