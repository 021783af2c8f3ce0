"""A namespace that ROS does not take."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_opaque
from composer.analysis.words import safe_name
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import System
from composer.names import join, namespace_problem, node_name_problem

RULE = register(
    Rule(
        code="RC222",
        name="invalid-namespace",
        severity=Severity.ERROR,
        summary="A namespace is not one that ROS takes.",
        why=(
            "The parts of a namespace consist of letters, digits and underscores, none begins "
            "with a digit, and there is one slash between them (rmw_validate_namespace). The name "
            "of a system is such a part: its own node is /<system>/manager."
        ),
        bad="""\
system: names
nodes:
  camera: {namespace: robot 1, on_activate: {log: started}}
""",
        good="""\
system: names
nodes:
  camera: {namespace: robot_1, on_activate: {log: started}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at the namespace of every node, and of the system's own; one of many is told once."""
    yield from _name_of_system(context.system)
    for node in context.system.nodes:
        namespace = node.namespace
        problem = namespace_problem(namespace.value)
        if problem is not None and not is_opaque(namespace.value):
            yield Diagnostic(RULE, f"namespace '{namespace}' {problem}", namespace.span)


def _name_of_system(system: System) -> Iterator[Diagnostic]:
    name = system.name
    if system.node_type or is_opaque(name.value):
        return
    problem = node_name_problem(name.value)
    if problem is None and namespace_problem(system.namespace) is None:
        problem = namespace_problem(join(system.namespace, name.value))
    if problem is not None:
        valid = safe_name(name.value)
        hint = f"call it '{valid}'" if valid != name.value else None
        yield Diagnostic(RULE, f"system name '{name}' {problem}", name.span, hint=hint)
