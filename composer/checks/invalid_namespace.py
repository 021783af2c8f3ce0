"""A namespace that ROS does not take."""

from __future__ import annotations

from collections.abc import Iterator

from composer.checks.context import Context, is_opaque
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.names import namespace_problem

RULE = register(
    Rule(
        code="RC222",
        name="invalid-namespace",
        severity=Severity.ERROR,
        summary="A namespace is not one that ROS takes.",
        why=(
            "The parts of a namespace consist of letters, digits and underscores, none begins "
            "with a digit, and there is one slash between them (rmw_validate_namespace)."
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
    """Look at the namespace of every node; one that many nodes share is reported once."""
    for node in context.system.nodes:
        namespace = node.namespace
        problem = namespace_problem(namespace.value)
        if problem is not None and not is_opaque(namespace.value):
            yield Diagnostic(RULE, f"namespace '{namespace}' {problem}", namespace.span)
