"""A node name that is not valid in ROS."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.formatting import free_name, safe_name
from composer.diagnostics import Diagnostic, error
from composer.names import node_name_problem
from composer.source import Located

RULE = error(
    code="RC221",
    name="invalid-node-name",
    summary="A node name is not valid in ROS.",
    why=(
        "Node names consist of letters, digits and underscores and do not start with a digit "
        "(rmw_validate_node_name). rclpy refuses to create a node with any other name."
    ),
    bad="""\
system: names
nodes:
  front-camera: {on_activate: {log: started}}
""",
    good="""\
system: names
nodes:
  front_camera: {on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the name of every node, and those of inner nodes, which may be in a namespace."""
    names = {node.ros_name.value for node in context.system.nodes}
    for node in context.system.nodes:
        yield from _check(node.ros_name, names)
        listed = node.executable.nodes if node.executable is not None else None
        for name in listed or ():
            for part in (
                name.value.removeprefix("/").split("/") if name is not node.own_name else ()
            ):
                yield from _check(Located(part, name.span), names)


def _check(name: Located[str], names: set[str]) -> Iterator[Diagnostic]:
    problem = node_name_problem(name.value)
    if problem is not None and not is_unresolved(name.value):
        yield Diagnostic(
            RULE,
            f"node name '{name}' {problem}",
            name.span,
            hint=f"rename it to '{free_name(safe_name(name.value), names)}'",
        )
