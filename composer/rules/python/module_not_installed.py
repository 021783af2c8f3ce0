"""An import of a module that is not installed."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC445",
        name="module-not-installed",
        severity=Severity.INFO,
        summary="A behavior imports a module that is not installed on this computer.",
        why=(
            "The node cannot be created on a computer without the module. If it is installed "
            "where the system runs, ignore this."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
import fastkalman


class Counter:
    def on_tick(self):
        fastkalman.predict()
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
import gc


class Counter:
    def on_tick(self):
        gc.collect()
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the modules that are not installed."""
    yield from diagnostics_of(context, Kind.NOT_INSTALLED, RULE)
