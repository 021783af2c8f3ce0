"""An attribute that a behavior does not have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC442",
        name="unknown-attribute",
        severity=Severity.ERROR,
        summary="A behavior uses a port, a parameter or another attribute that does not exist.",
        why=(
            "self.publishers, self.clients, self.action_clients and self.parameters have "
            "exactly what the node declares. Any other name raises AttributeError when the line "
            "is reached."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    publishers: {count: {type: std_msgs/msg/Int32, qos: command, external: true}}
    timers: {tick: {period_ms: 100}}
# file: counter.py
from std_msgs.msg import Int32


class Counter:
    def on_tick(self):
        self.publishers.counts.publish(Int32(data=1))
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    publishers: {count: {type: std_msgs/msg/Int32, qos: command, external: true}}
    timers: {tick: {period_ms: 100}}
# file: counter.py
from std_msgs.msg import Int32


class Counter:
    def on_tick(self):
        self.publishers.count.publish(Int32(data=1))
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the attributes that do not exist."""
    yield from diagnostics_of(context, Kind.ATTRIBUTE, RULE)
