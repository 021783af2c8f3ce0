"""A setting of a node with a class that only nodes with a behavior have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.call_settings import callback_settings
from composer.analysis.context import Context
from composer.analysis.python_nodes import hosted_classes
from composer.diagnostics import Diagnostic, error
from composer.rules.python.definitions import rclpy_class

_LISTENING = (
    "    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command, external: true%s}}\n"
)
RULE = error(
    code="RC468",
    name="class-setting",
    summary="A node with a class declares reactions, timers, state or limits of calls.",
    why=(
        "The class has callbacks and timers of its own; its ports are declared to be checked "
        "and connected. What the YAML file says they do would have no effect."
    ),
    bad=rclpy_class(keys=_LISTENING % ', log: "{message.data}"'),
    good=rclpy_class(keys=_LISTENING % ""),
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the nodes whose class has callbacks of its own."""
    for item in hosted_classes(context):
        for what, span in callback_settings(item.node):
            message = f"{what} has no effect: node '{item.node.name}' has a class"
            yield Diagnostic(RULE, message, span, hint="remove it, or write a behavior")
