"""Behaviors whose module or class is missing, or that are rclpy nodes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python_nodes import behaviors
from composer.diagnostics import Diagnostic, Label, error
from composer.rules.python.definitions import on_tick, rclpy_class
from composer.rules.python.missing import missing, unnamed

_COUNTER = on_tick("pass")
_NODE = rclpy_class()

MODULE_MISSING = error(
    code="RC431",
    name="behavior-module-missing",
    summary="The Python module of a behavior does not exist or cannot be read.",
    why=(
        "The module is searched for next to the YAML file, in the project's nodes/ folder, "
        "and on Python's module search path. It is parsed, not imported."
    ),
    bad=_COUNTER.replace("counter:Counter", "conter:Counter"),
    good=_COUNTER,
)
CLASS_MISSING = error(
    code="RC432",
    name="behavior-class-missing",
    summary="The module of a behavior does not define a class of that name.",
    why="The node cannot be created without the class.",
    bad=_COUNTER.replace("counter:Counter", "counter:Conter"),
    good=_COUNTER,
)
NODE_AS_BEHAVIOR = error(
    code="RC534",
    name="node-as-behavior",
    summary="A behavior is derived from rclpy's Node or LifecycleNode.",
    why=(
        "A behavior belongs to a node of the composer and has no ports of its own. A class "
        "that is a ROS node runs with 'class'."
    ),
    bad=_NODE.replace("class: ", "behavior: "),
    good=_NODE,
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check that every behavior names a class, and that its module can be read and defines it."""
    for node in context.system.nodes:
        if node.behavior is not None:
            yield from unnamed(node.behavior, "behavior", CLASS_MISSING)
    for _, source in behaviors(context):
        yield from missing(source, MODULE_MISSING, CLASS_MISSING, MODULE_MISSING)
        if source.class_span is not None and source.is_rclpy_node:
            yield Diagnostic(
                NODE_AS_BEHAVIOR,
                f"'{source.reference.class_name}' is an rclpy node, not a behavior",
                source.reference.text.span,
                (Label(source.class_span, "here"),),
                "write 'class' instead of 'behavior'",
            )
