"""A name that is not defined."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC447",
        name="undefined-name",
        severity=Severity.ERROR,
        summary="A behavior uses a name that is neither defined nor imported.",
        why=(
            "The line raises NameError when it is reached. Annotations are not checked, because "
            "they need not be evaluated."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
class Counter:
    def on_tick(self):
        count = 1
        self.log.info(f"{cuont}")
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
        count = 1
        self.log.info(f"{count}")
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the names that are not defined."""
    yield from diagnostics_of(context, Kind.NAME, RULE)
