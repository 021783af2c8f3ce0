"""A handler that does not accept the arguments of its event."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.analysis.python.behaviors import GENERAL_HANDLERS, behaviors, handlers
from composer.behavior_checks import Kind
from composer.behavior_source import BehaviorSource
from composer.behavior_source.receivers import lacks_self
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.source import Span

RULE = register(
    Rule(
        code="RC435",
        name="handler-signature",
        severity=Severity.ERROR,
        summary="A handler does not accept the arguments it is called with.",
        why="Every call raises TypeError; for a transition handler, this happens during bring-up.",
        bad="""\
# file: system.yaml
system: behavior
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
system: behavior
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
    """Check the arguments of every handler whose signature is known."""
    yield from diagnostics_of(context, Kind.SIGNATURE, RULE)
    for node, source in context.once(behaviors):
        place = source.reference.text.span
        expected = {name: (arguments, place) for name, arguments in GENERAL_HANDLERS.items()}
        for handler in handlers(node):
            expected[handler.name] = (handler.arguments, handler.of.span)
        for name, (arguments, span) in expected.items():
            yield from _method(source, name, arguments, span)


def _method(
    source: BehaviorSource, name: str, arguments: tuple[str, ...], span: Span
) -> Iterator[Diagnostic]:
    method = source.method(name)
    if method is None or method.accepts(len(arguments)):
        return
    if method.node is not None and lacks_self(method.node, len(arguments)):
        return
    takes = ", ".join(("self", *method.arguments))
    gets = ", ".join(("self", *arguments))
    yield Diagnostic(
        RULE,
        f"'{name}' of '{source.reference.class_name}' is called with ({gets}), but takes ({takes})",
        method.span,
        (Label(span, "called here"),),
        f"write 'def {name}({gets})'",
    )
