"""Two nodes with the same full name in ROS."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, Label, error
from composer.model import Node
from composer.source import Span

RULE = error(
    code="RC227",
    name="duplicate-full-name",
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the full names of all nodes."""
    first: dict[str, tuple[Node, Span]] = {}
    for node in context.system.nodes:
        for name, span in _names(node):
            other, place = first.setdefault(name, (node, span))
            if other is not node and not is_unresolved(name):
                yield Diagnostic(
                    RULE,
                    f"nodes '{node.name}' and '{other.name}' both have the full name '{name}'",
                    span,
                    (Label(place, "the other node"),),
                    hint="set another 'name' or 'namespace'",
                )


def _names(node: Node) -> Iterator[tuple[str, Span]]:
    yield node.full_name, node.ros_name.span
    for name in node.inner_nodes:
        yield name, node.name.span
