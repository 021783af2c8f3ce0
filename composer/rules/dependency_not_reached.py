"""A node that waits for a state which another one never reaches by itself."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import Node, PrimaryState, System

RULE = register(
    Rule(
        code="RC402",
        name="dependency-not-reached",
        severity=Severity.WARNING,
        summary="A node needs another one in a state that its autostart does not take it to.",
        why=(
            "The bring-up leaves the waiting node inactive, and it stays so until somebody moves "
            "the other one by hand."
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
)

_RANK = {PrimaryState.UNCONFIGURED: 0, PrimaryState.INACTIVE: 1, PrimaryState.ACTIVE: 2}


def check(context: Context) -> Iterator[Diagnostic]:
    """Hold what nodes wait for against where the others are started."""
    system = context.system
    for node in system.nodes:
        for dependency in node.depends_on:
            other = system.node(dependency.node.value)
            if other is None or other is node or _start(system, node) < _RANK[dependency.state]:
                continue
            if other.autostart is not None and _start(system, other) < _RANK[dependency.state]:
                yield Diagnostic(
                    RULE,
                    f"node '{node.name}' needs '{other.name}' {dependency.state}, "
                    f"but '{other.name}' is started only as far as {other.autostart}",
                    dependency.node.span,
                    (Label(other.autostart.span, "stays here until it is moved by hand"),),
                    _hint(other.autostart.value),
                )


def _start(system: System, node: Node) -> int:
    """Return the rank of the state that the bring-up takes a node to, if nothing is in the way."""
    own = node.autostart.value if node.autostart is not None else system.autostart
    return min(_RANK[own], _RANK[system.autostart])


def _hint(reached: PrimaryState) -> str:
    if reached is PrimaryState.UNCONFIGURED:
        return "let it start further, or do not depend on it"
    return f"let it start further, or depend on it being {reached}"
