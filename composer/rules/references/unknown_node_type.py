"""A node of a type that does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error, suggestion

RULE = error(
    code="RC201",
    name="unknown-node-type",
    summary="A node's type is neither in the project's nodes/ folder nor built in.",
    why="Without the type, the ports and the behavior of the node are unknown.",
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the type of every node that names one."""
    for node in context.system.nodes:
        name = node.type_name
        if name is None or node.type_found or is_unresolved(name.value):
            continue
        if context.node_types.find(name.value) is not None:
            continue  # the file exists but is invalid, which is reported elsewhere
        if context.node_types.find_outside_project(name.value) is not None:
            message = f"the file of node type '{name}' is a symbolic link out of the project"
            yield Diagnostic(RULE, message, name.span, hint="copy the target into the project")
            continue
        yield Diagnostic(
            RULE,
            f"node '{node.name}' has type '{name}', which does not exist",
            name.span,
            hint=suggestion(name.value, context.node_types.names()),
        )
