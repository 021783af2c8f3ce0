"""A port or timer that nothing is done for."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.behaviors import Handler, complete_behaviors, handlers
from composer.analysis.context import Context
from composer.analysis.orphans import orphans
from composer.behavior_source import BehaviorSource, Method
from composer.diagnostics import Diagnostic, Label, Rule, Severity, nearest, register

RULE = register(
    Rule(
        code="RC433",
        name="missing-handler",
        severity=Severity.ERROR,
        summary="A behaviour has no method for a port or a timer of its node.",
        why=(
            "Handlers bind by name: subscription 'scan' calls 'on_scan'. Without the method "
            "messages would vanish, timers fire for nothing, requests go unanswered."
        ),
        bad="""\
# file: system.yaml
system: behaviour
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
class Counter:
    def on_tock(self):
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
    """Hold ports and timers against the methods of the behaviour."""
    for node, source in complete_behaviors(context):
        lost = {method.name: method for method in orphans(node, source)}
        for handler in handlers(node):
            if handler.needed and source.method(handler.name) is None:
                yield _finding(source, handler, lost)


def _finding(source: BehaviorSource, handler: Handler, lost: dict[str, Method]) -> Diagnostic:
    signature = f"{handler.name}({', '.join(('self', *handler.arguments))})"
    close = nearest(handler.name, lost)
    label = Label(lost[close].span, f"'{close}' belongs to nothing") if close else None
    if label is None and source.class_span is not None:
        label = Label(source.class_span, "the behaviour")
    return Diagnostic(
        RULE,
        f"{handler.kind} '{handler.of}' has no handler: "
        f"'{source.reference.class_name}' has no method '{handler.name}'",
        handler.of.span,
        (label,) if label is not None else (),
        f"rename it to '{handler.name}'" if close else f"add 'def {signature}'",
    )
