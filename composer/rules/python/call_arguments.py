"""A call with arguments that the function does not take."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC452",
        name="call-arguments",
        severity=Severity.ERROR,
        summary="A call does not fit the parameters of the function.",
        why=(
            "The call raises a TypeError, or passes a value that contradicts the annotation of the "
            "parameter. Checked are functions and methods of the behavior's files, and the methods "
            "of ports, goals, the log and the clock."
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
        self.report()

    def report(self, text: str):
        self.log.info(text)
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
        self.report("tick")

    def report(self, text: str):
        self.log.info(text)
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the calls."""
    yield from diagnostics_of(context, Kind.CALL, RULE)
