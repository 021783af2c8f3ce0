"""A dependency on a state that a node does not reach by itself."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, warning
from composer.model import Node, PrimaryState, System

RULE = warning(
    code="RC402",
    name="dependency-not-reached",
    summary="A node depends on a state that the other node's autostart does not reach.",
    why=(
        "The bring-up leaves the dependent node inactive until the other node is moved to "
        "that state manually."
    ),
    bad="""\
system: waiting
nodes:
  planner: {lifecycle: {autostart: inactive}}
  motor_controller: {lifecycle: {depends_on: [planner]}}
""",
    good="""\
system: waiting
nodes:
  planner: {lifecycle: {autostart: inactive}}
  motor_controller: {lifecycle: {depends_on: {planner: inactive}}}
""",
)

_RANK = {PrimaryState.UNCONFIGURED: 0, PrimaryState.INACTIVE: 1, PrimaryState.ACTIVE: 2}


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the required states with the states that the bring-up reaches."""
    system = context.system
    for node in system.nodes:
        for dependency in node.depends_on:
            other = system.node(dependency.node.value)
            if other is None or other is node or _start(system, node) < _RANK[dependency.state]:
                continue
            if other.autostart is not None and _start(system, other) < _RANK[dependency.state]:
                yield Diagnostic(
                    RULE,
                    f"node '{node.name}' needs '{other.name}' to be {dependency.state}, "
                    f"but '{other.name}' autostarts only to {other.autostart}",
                    dependency.node.span,
                    (Label(other.autostart.span, "stays here until moved manually"),),
                    _hint(other.autostart.value),
                )


def _start(system: System, node: Node) -> int:
    """Return the rank of the state that the bring-up moves a node to, dependencies permitting."""
    own = node.autostart.value if node.autostart is not None else system.autostart
    return min(_RANK[own], _RANK[system.autostart])


def _hint(reached: PrimaryState) -> str:
    if reached is PrimaryState.UNCONFIGURED:
        return "raise its autostart, or remove the dependency"
    return f"raise its autostart, or depend on it being {reached}"
