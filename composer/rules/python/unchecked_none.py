"""A value that may be None, and is used without a check."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC456",
        name="unchecked-none",
        severity=Severity.WARNING,
        summary="A value that may be None is used without a check.",
        why=(
            "'get' of a dict returns None for a missing key, 're.match' without a match, and an "
            "attribute that is None at first stays so until a message comes. Any attribute of None "
            "raises AttributeError."
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
        self.last = None

    def on_total(self, message):
        self.last = message

    def on_tick(self):
        print(self.last.data)
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
        self.last = None

    def on_total(self, message):
        self.last = message

    def on_tick(self):
        if self.last is not None:
            print(self.last.data)
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the values that may be None."""
    yield from diagnostics_of(context, Kind.NONE, RULE)
