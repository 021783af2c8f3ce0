"""A class that its module does not have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.hosted_classes import hosted_classes
from composer.diagnostics import Diagnostic, Rule, Severity, register, suggestion

RULE = register(
    Rule(
        code="RC460",
        name="class-missing",
        severity=Severity.ERROR,
        summary="The Python module of a class does not have it, or cannot be parsed.",
        why="The node cannot be configured without its class. The module is parsed, not imported.",
        bad="""\
# file: system.yaml
system: robot
nodes:
  talker: {class: robot_nodes:Talkr}
# file: robot_nodes.py
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  talker: {class: robot_nodes:Talker}
# file: robot_nodes.py
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check that the module of every class can be read and has the class."""
    for found in context.once(hosted_classes):
        source, reference = found.source, found.hosted.reference
        if source.problem is not None:
            message = f"module '{reference.module}' {source.problem}"
            yield Diagnostic(RULE, message, found.span)
        elif source.module_found and not source.class_found:
            message = f"module '{reference.module}' has no class '{reference.class_name}'"
            hint = suggestion(reference.class_name, source.class_names)
            yield Diagnostic(RULE, message, found.span, hint=hint)
