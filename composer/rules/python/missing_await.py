"""An asynchronous call without await."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC443",
        name="missing-await",
        severity=Severity.ERROR,
        summary="A behavior calls something asynchronous and does not await it.",
        why=(
            "Without 'await', the call returns immediately: an 'async def' method does not even "
            "start, and the result of a service or an action is not available."
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
    async def on_tick(self):
        self.clock.sleep(0.05)
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
    async def on_tick(self):
        await self.clock.sleep(0.05)
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the calls that are not awaited."""
    yield from diagnostics_of(context, Kind.AWAIT, RULE)
