"""A class whose module is not installed."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.hosted_classes import hosted_classes
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC461",
        name="class-not-installed",
        severity=Severity.INFO,
        summary="The Python module of a class is not found on this computer.",
        why=(
            "The class is not checked, and the node cannot be configured on a computer without "
            "it. If it is installed where the system runs, ignore this."
        ),
        bad="""\
system: robot
nodes:
  talker: {class: "nodes_for_mars.talker:Talker"}
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
    """Look for the module of every class."""
    for found in context.once(hosted_classes):
        module, nearby = found.hosted.reference.module, found.nearby
        if nearby is None or nearby.is_misspelled:
            continue  # another rule reports it
        yield Diagnostic(
            RULE,
            f"module '{module}' is not found on this computer, so its class is not checked",
            found.span,
            hint=nearby.hint
            or (
                f"expected {module.replace('.', '/')}.py next to the YAML file, among the node"
                " types, or on Python's module search path"
            ),
        )
