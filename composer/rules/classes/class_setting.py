"""A setting that has no effect on a node with a class."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.call_settings import call_limits, callback_settings
from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import Node, Port
from composer.source import Span

RULE = register(
    Rule(
        code="RC468",
        name="class-setting",
        severity=Severity.ERROR,
        summary="A node with a class declares reactions, timers, state or limits of calls.",
        why=(
            "The class has callbacks and timers of its own; its ports are declared to be checked "
            "and connected. What the YAML file says they do would have no effect."
        ),
        bad="""\
# file: system.yaml
system: robot
nodes:
  listener:
    class: robot_nodes:Listener
    subscriptions:
      chatter: {type: std_msgs/msg/String, qos: command, external: true, log: "{message.data}"}
# file: robot_nodes.py
from rclpy.node import Node


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  listener:
    class: robot_nodes:Listener
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
# file: robot_nodes.py
from rclpy.node import Node


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the nodes that have a class."""
    for node in context.system.nodes:
        if node.hosted_class is None or node.external is not None:
            continue
        for what, span in _settings(node):
            yield Diagnostic(
                RULE,
                f"{what} has no effect: node '{node.name}' has a class",
                span,
                hint="remove it, or write a behavior",
            )


def _settings(node: Node) -> Iterator[tuple[str, Span]]:
    yield from callback_settings(node)
    for port in node.ports:
        for event, reaction in port.reactions:
            yield f"the reaction of {port.kind} '{port.name}' to its {event}", reaction.span
        if _has_answer(port):
            yield f"the reaction of {port.kind} '{port.name}'", port.span
        yield from call_limits(port)


def _has_answer(port: Port) -> bool:
    return port.result is not None or port.feedback is not None or port.accept is not None
