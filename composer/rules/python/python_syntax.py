"""A behavior or class whose module is not valid Python."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behaviors import behaviors
from composer.analysis.python.hosted_classes import hosted_classes
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.source import Span

RULE = register(
    Rule(
        code="RC441",
        name="python-syntax",
        severity=Severity.ERROR,
        summary="The module of a behavior or class is not valid Python.",
        why=(
            "The node cannot be created. The module is compiled and not executed, so that all "
            "errors of Python's compiler are found, such as 'await' outside an async function."
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
        await self.clock.sleep(0.05)
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
    """Report the first error of each module."""
    reported: set[Span] = set()
    behaviors_of_nodes = ((source, "behavior") for _, source in context.once(behaviors))
    classes = ((found.source, "class") for found in context.once(hosted_classes))
    for source, what in (*behaviors_of_nodes, *classes):
        if source.problem is not None and source.problem_span is not None:
            label = Label(source.reference.text.span, f"the {what} of this node")
            yield Diagnostic(
                RULE,
                f"module '{source.reference.module}' {source.problem}",
                source.problem_span,
                (label,),
            )
        for message, span in source.broken:
            if span not in reported:
                reported.add(span)
                label = Label(source.reference.text.span, f"the {what} of this node imports it")
                yield Diagnostic(RULE, message, span, (label,))
