"""A handler that cannot be called as handlers are."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.behaviors import GENERAL_HANDLERS, behaviors, handlers
from composer.analysis.context import Context
from composer.behavior_source import BehaviorSource
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.source import Span

RULE = register(
    Rule(
        code="RC435",
        name="handler-signature",
        severity=Severity.ERROR,
        summary="A handler takes other arguments than it will be called with.",
        why="Every call would raise TypeError: for a lifecycle handler, at start-up.",
        bad="""\
# file: system.yaml
system: behaviour
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
class Counter:
    def on_tick(self, timer):
        pass
""",
        good="""\
# file: system.yaml
system: behaviour
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
class Counter:
    def on_tick(self):
        pass
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at the arguments of every handler whose signature is known."""
    for node, source in context.once(behaviors):
        place = source.reference.text.span
        wanted = {name: (arguments, place) for name, arguments in GENERAL_HANDLERS.items()}
        for handler in handlers(node):
            wanted[handler.name] = (handler.arguments, handler.of.span)
        for name, (arguments, span) in wanted.items():
            yield from _method(source, name, arguments, span)


def _method(
    source: BehaviorSource, name: str, arguments: tuple[str, ...], span: Span
) -> Iterator[Diagnostic]:
    method = source.method(name)
    if method is None or method.accepts(len(arguments)):
        return
    takes = ", ".join(("self", *method.arguments))
    gets = ", ".join(("self", *arguments))
    yield Diagnostic(
        RULE,
        f"'{name}' of '{source.reference.class_name}' is called as ({gets}), but takes ({takes})",
        span,
        (Label(method.span, "defined here"),),
        f"write 'def {name}({gets})'",
    )
