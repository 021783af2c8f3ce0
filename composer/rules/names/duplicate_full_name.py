"""Two nodes with the same full name in ROS."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import Node

RULE = register(
    Rule(
        code="RC227",
        name="duplicate-full-name",
        severity=Severity.ERROR,
        summary="Two nodes have the same name and namespace in ROS.",
        why=(
            "ROS starts both, with a warning. Then requests to parameter and lifecycle services "
            "reach either node, and tools show only one of them."
        ),
        bad="""\
system: names
nodes:
  front: {name: camera, on_activate: {log: started}}
  rear: {name: camera, on_activate: {log: started}}
""",
        good="""\
system: names
nodes:
  front: {name: camera, namespace: front, on_activate: {log: started}}
  rear: {name: camera, namespace: rear, on_activate: {log: started}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the full names of all nodes."""
    first: dict[str, Node] = {}
    for node in context.system.nodes:
        known = first.setdefault(node.full_name, node)
        if known is not node and not is_unresolved(node.full_name):
            yield Diagnostic(
                RULE,
                f"nodes '{node.name}' and '{known.name}' both have the full name"
                f" '{node.full_name}'",
                node.ros_name.span,
                (Label(known.ros_name.span, "the other node"),),
                hint="set another 'name' or 'namespace'",
            )
