"""A loop that neither ends nor waits."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behaviors import (
    GENERAL_HANDLERS,
    distinct_behaviors,
    handlers,
    reached_methods,
)
from composer.behavior_source import Method
from composer.behavior_source.flow import endless_loops
from composer.behavior_source.spans import start_span
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC450",
        name="endless-loop",
        severity=Severity.WARNING,
        summary="A loop in a behavior neither ends nor awaits anything.",
        why=(
            "While it runs, no other callback of its executor is called, so nothing can end it: "
            "neither a message nor a request to cancel. Await self.clock.sleep in the loop."
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
        self.count = 0
        while True:
            self.count += 1
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
        self.count = 0
        while True:
            self.count += 1
            await self.clock.sleep(0.05)
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the loops in the handlers of every behavior, and in the methods that these call."""
    for node, source in context.once(distinct_behaviors):
        names = (*GENERAL_HANDLERS, *(handler.name for handler in handlers(node)))
        found = {name: method for name in names if (method := source.method(name)) is not None}
        for method in reached_methods(source, *found.values()):
            for loop in endless_loops(method.node) if method.node is not None else ():
                yield _diagnostic(method, loop)


def _diagnostic(method: Method, loop: ast.While) -> Diagnostic:
    message = f"this loop in '{method.name}' blocks its executor: it neither ends nor waits"
    hint = "add 'await self.clock.sleep(...)'"
    if not method.is_async:
        hint += f", and write 'async def {method.name}'"
    span = start_span(loop, len("while"), method.span.file)
    return Diagnostic(RULE, message, span, hint=hint)
