"""A handler that annotates its argument with another type."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC451",
        name="handler-annotation",
        severity=Severity.WARNING,
        summary="A handler annotates its argument with another message type than its port has.",
        why=(
            "The port determines the type of the messages. The annotation misleads readers and "
            "type checkers, or the type of the port is wrong."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    subscriptions: {count: {type: std_msgs/msg/Int32, qos: command, external: true}}
# file: counter.py
from std_msgs.msg import String


class Counter:
    def on_count(self, message: String):
        self.log.info(f"{message.data}")
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    subscriptions: {count: {type: std_msgs/msg/Int32, qos: command, external: true}}
# file: counter.py
from std_msgs.msg import Int32


class Counter:
    def on_count(self, message: Int32):
        self.log.info(f"{message.data}")
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the annotations that differ."""
    yield from diagnostics_of(context, Kind.ANNOTATION, RULE)
