"""A class that its module does not have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.endpoints.references import class_name_hint
from composer.analysis.python.hosted_classes import ClassOfNode, hosted_classes
from composer.behavior_source import NearbyModules
from composer.diagnostics import Diagnostic, Rule, Severity, register, suggestion
from composer.model import BehaviorReference

RULE = register(
    Rule(
        code="RC460",
        name="class-missing",
        severity=Severity.ERROR,
        summary="The class, or its module in a package that exists, is missing or unreadable.",
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
    for node in context.system.nodes:
        if node.hosted_class is not None:
            yield from _unnamed(node.hosted_class.reference)
    for found in context.once(hosted_classes):
        source, reference = found.source, found.hosted.reference
        if source.problem_span is not None:
            continue  # another rule reports it in the module
        if source.problem is not None:
            message = f"module '{reference.module}' {source.problem}"
            yield Diagnostic(RULE, message, found.span)
        elif found.nearby is not None:
            yield from _missing_module(found, found.nearby)
        elif source.module_found and not source.class_found:
            message = f"module '{reference.module}' has no class '{reference.class_name}'"
            hint = suggestion(reference.class_name, source.class_names)
            yield Diagnostic(RULE, message, found.span, hint=hint)


def _unnamed(reference: BehaviorReference) -> Iterator[Diagnostic]:
    text = reference.text
    if not ((reference.module and reference.class_name) or is_unresolved(text.value)):
        message = f"class '{text}' is not 'module:Class'"
        yield Diagnostic(RULE, message, text.span, hint=class_name_hint(text.value))


def _missing_module(found: ClassOfNode, nearby: NearbyModules) -> Iterator[Diagnostic]:
    """Report a module that is most likely misspelled: others are not installed."""
    if nearby.package:
        message = f"package '{nearby.package}' has no module '{nearby.missing}'"
        hint = suggestion(nearby.missing, nearby.names)
        yield Diagnostic(RULE, message, found.span, hint=hint)
    elif nearby.is_misspelled:
        message = f"no Python module named '{nearby.missing}'"
        yield Diagnostic(RULE, message, found.span, hint=nearby.hint)
