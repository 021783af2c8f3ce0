"""A node of a type that there is no file for."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_opaque
from composer.diagnostics import Diagnostic, Rule, Severity, register, suggestion

RULE = register(
    Rule(
        code="RC201",
        name="unknown-node-type",
        severity=Severity.ERROR,
        summary="A node's type is neither in the project's nodes/ nor one of the composer's own.",
        why="Without its type nothing is known of the node: neither its ports nor its behaviour.",
        bad="""\
system: stubs
nodes:
  planner:
    type: servce_stub
    variables: {service_type: std_srvs/srv/Trigger}
""",
        good="""\
system: stubs
nodes:
  planner:
    type: service_stub
    variables: {service_type: std_srvs/srv/Trigger}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at the type of every node that names one."""
    for node in context.system.nodes:
        name = node.type_name
        if name is None or node.type_found or is_opaque(name.value):
            continue
        if context.catalog.find(name.value) is not None:
            continue  # the file is there but broken, and that has been said
        if context.catalog.stray(name.value) is not None:
            message = f"the file of node type '{name}' is a link that leads out of the project"
            yield Diagnostic(RULE, message, name.span, hint="copy the file it leads to")
            continue
        yield Diagnostic(
            RULE,
            f"node '{node.name}' is of type '{name}', which does not exist",
            name.span,
            hint=suggestion(name.value, context.catalog.names()),
        )
