"""Functions of asyncio, which need another event loop."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC454",
        name="asyncio-call",
        severity=Severity.ERROR,
        summary="A behavior awaits a function of asyncio.",
        why=(
            "Handlers run on the event loop of the composer, which also waits for ROS. Functions "
            "of asyncio need a running loop of asyncio and raise an error. Wait with "
            "'self.clock.sleep'; run libraries that need asyncio in a thread, with 'asyncio.run'."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
import asyncio


class Counter:
    async def on_tick(self):
        await asyncio.sleep(0.05)
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
    """Report what is awaited."""
    yield from diagnostics_of(context, Kind.ASYNCIO, RULE)
