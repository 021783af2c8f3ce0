"""Behaviors whose module or class is missing, or that are rclpy nodes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.endpoints.references import class_name_hint
from composer.analysis.python_nodes import behaviors
from composer.analysis.spans import part_of
from composer.diagnostics import Diagnostic, Label, suggestion
from composer.model import BehaviorReference
from composer.project import Project
from composer.python_code.nodes.classes import is_rclpy_node
from composer.python_code.source import BehaviorSource, nearby_modules
from composer.rules.python.definitions import error

_PLANNER = """\
# file: system.yaml
system: behavior
nodes:
  planner: {behavior: planner:Planner}
# file: planner.py
class Planner:
    pass
"""
_NODE = """\
# file: system.yaml
system: robot
nodes:
  talker: {behavior: "robot_nodes:Talker"}
# file: robot_nodes.py
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
"""

MODULE_MISSING = error(
    code="RC431",
    name="behavior-module-missing",
    summary="The Python module of a behavior does not exist or cannot be read.",
    why=(
        "The module is searched for next to the YAML file, in the project's nodes/ folder, "
        "and on Python's module search path. It is parsed, not imported."
    ),
    bad=_PLANNER.replace("planner:Planner", "plannr:Planner"),
    good=_PLANNER,
)
CLASS_MISSING = error(
    code="RC432",
    name="behavior-class-missing",
    summary="The module of a behavior does not define a class of that name.",
    why="The node cannot be created without the class.",
    bad=_PLANNER.replace("planner:Planner", "planner:Planer"),
    good=_PLANNER,
)
NODE_AS_BEHAVIOR = error(
    code="RC534",
    name="node-as-behavior",
    summary="A behavior is derived from rclpy's Node or LifecycleNode.",
    why=(
        "A behavior belongs to a node of the composer and has no ports of its own. A class "
        "that is a ROS node runs with 'class'."
    ),
    bad=_NODE,
    good=_NODE.replace("behavior:", "class:"),
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check that every behavior names a class, and that its module can be read and defines it."""
    for node in context.system.nodes:
        if node.behavior is not None and not node.behavior.class_name:
            yield from _unnamed(node.behavior)
    for _, source in behaviors(context):
        if not source.module_found or source.problem is not None:
            yield from _unreadable(source)
        elif not source.class_found and source.path is not None:  # or else it is compiled
            reference = source.reference
            yield Diagnostic(
                CLASS_MISSING,
                f"module '{reference.module}' has no class '{reference.class_name}'",
                part_of(reference.text, len(reference.module) + 1, len(reference.class_name)),
                hint=suggestion(reference.class_name, source.class_names),
            )
        elif source.class_span is not None and is_rclpy_node(source):
            yield Diagnostic(
                NODE_AS_BEHAVIOR,
                f"'{source.reference.class_name}' is an rclpy node, not a behavior",
                source.reference.text.span,
                (Label(source.class_span, "here"),),
                "write 'class' instead of 'behavior'",
            )


def _unreadable(source: BehaviorSource) -> Iterator[Diagnostic]:
    reference = source.reference
    span = part_of(reference.text, 0, len(reference.module))
    if not source.module_found:
        nearby = nearby_modules(reference.module, reference.folder, Project.at(reference.folder))
        message = f"no Python module named '{reference.module}'"
        expected = f"expected {reference.module.replace('.', '/')}.py next to the YAML file"
        yield Diagnostic(MODULE_MISSING, message, span, hint=nearby.hint or expected)
    elif source.problem_span is None:  # or else it is reported in the module
        yield Diagnostic(MODULE_MISSING, f"module '{reference.module}' {source.problem}", span)


def _unnamed(reference: BehaviorReference) -> Iterator[Diagnostic]:
    text = reference.text
    if not is_unresolved(text.value):
        message = f"behavior '{text}' names no class"
        yield Diagnostic(CLASS_MISSING, message, text.span, hint=class_name_hint(text.value))
