"""A class that brings a context or command-line arguments of its own."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.hosted_classes import calls_in, hosted_classes
from composer.behavior_source.method_body import is_none
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC466",
        name="class-context",
        severity=Severity.ERROR,
        summary="A class gives its node a context or command-line arguments of its own.",
        why=(
            "A hosted node joins the ROS graph with the context of the system, and its names and "
            "parameters come from YAML."
        ),
        bad="""\
# file: system.yaml
system: robot
nodes:
  talker: {class: robot_nodes:Talker}
# file: robot_nodes.py
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker", cli_args=["--ros-args", "-r", "chatter:=talk"])
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  talker: {class: robot_nodes:Talker, namespace: left}
# file: robot_nodes.py
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
""",
    )
)

_HINTS = {
    "context": "leave it out, or run the program as an 'executable'",
    "cli_args": "use 'remappings' and 'parameters' of the node",
}


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the arguments of the call of ``Node.__init__``."""
    for found in context.once(hosted_classes):
        constructor = found.constructor
        if constructor is None:
            continue
        for call, span in calls_in(constructor):
            if not (isinstance(call.func, ast.Attribute) and call.func.attr == "__init__"):
                continue
            for keyword in call.keywords:
                if keyword.arg in _HINTS and not is_none(keyword.value):
                    yield found.diagnostic(
                        RULE,
                        f"'{found.source.reference.class_name}' gives its node a '{keyword.arg}' of"
                        " its own",
                        span,
                        _HINTS[keyword.arg],
                    )
