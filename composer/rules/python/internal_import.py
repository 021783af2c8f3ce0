"""An import of an internal module of the composer."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC446",
        name="internal-import",
        severity=Severity.WARNING,
        summary="A behavior imports an internal module of the composer.",
        why=(
            "Only composer.behavior is an API: other modules change without notice, and may not "
            "work outside the process that they were written for."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
from composer.names import expand_name


class Counter:
    def on_tick(self):
        self.log.info(expand_name("count", "counter", "/"))
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
class Counter:
    def on_tick(self):
        self.log.info(self.name)
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the imports of internal modules."""
    yield from diagnostics_of(context, Kind.INTERNAL, RULE)
