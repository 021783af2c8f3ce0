"""An attribute of a behavior that gets values of different kinds."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC455",
        name="attribute-kind",
        severity=Severity.WARNING,
        summary="An attribute of a behavior gets a value of another kind than at first.",
        why=(
            "A number that becomes a message or a list is probably a field that was forgotten, as "
            "in 'self.speed = message' instead of 'message.data'. It fails where it is used."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    subscriptions: {total: {type: std_msgs/msg/Int32, qos: command, external: true}}
    timers: {tick: {period_ms: 100}}
# file: counter.py
class Counter:
    def on_configure(self):
        self.total = 0

    def on_total(self, message):
        self.total = message

    def on_tick(self):
        print(self.total)
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    subscriptions: {total: {type: std_msgs/msg/Int32, qos: command, external: true}}
    timers: {tick: {period_ms: 100}}
# file: counter.py
class Counter:
    def on_configure(self):
        self.total = 0

    def on_total(self, message):
        self.total = message.data

    def on_tick(self):
        print(self.total)
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the attributes that change their kind."""
    yield from diagnostics_of(context, Kind.CHANGED, RULE)
