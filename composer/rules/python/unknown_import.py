"""An import that fails."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC444",
        name="unknown-import",
        severity=Severity.ERROR,
        summary="A behavior imports a module or a name that does not exist.",
        why=(
            "The node cannot be created if an import of its module fails. Modules of the "
            "project, of the standard library, of interfaces and of the composer are checked."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
from math import sqroot


class Counter:
    def on_tick(self):
        self.log.info(f"{sqroot(2.0):.2f}")
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
from math import sqrt


class Counter:
    def on_tick(self):
        self.log.info(f"{sqrt(2.0):.2f}")
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the imports that fail."""
    yield from diagnostics_of(context, Kind.IMPORT, RULE)
