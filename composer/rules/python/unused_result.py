"""A statement without an effect."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC453",
        name="unused-result",
        severity=Severity.WARNING,
        summary="A comparison, a function, an 'except' or a new attribute is without effect.",
        why=(
            "'self.count == 0' compares and forgets the result: assign with '='. 'self.report' "
            "names a method without calling it. An attribute that is set, never read, and named "
            "almost like another one is probably misspelled. An 'except' after one for a base "
            "class never catches anything."
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
    count = 1

    def on_tick(self):
        self.count == 0
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
    count = 1

    def on_tick(self):
        self.count = 0
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the statements."""
    yield from diagnostics_of(context, Kind.UNUSED, RULE)
