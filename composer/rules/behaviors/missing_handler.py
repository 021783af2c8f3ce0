"""A port or timer without a handler."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behaviors import (
    Handler,
    complete_behaviors,
    handlers,
    unbound_handlers,
)
from composer.behavior_source import BehaviorSource, Method
from composer.diagnostics import Diagnostic, Label, Rule, Severity, nearest, register

RULE = register(
    Rule(
        code="RC433",
        name="missing-handler",
        severity=Severity.ERROR,
        summary="A behavior has no method for a port or timer of its node.",
        why=(
            "Handlers bind by name: subscription 'scan' calls 'on_scan'. Without the method, "
            "messages are dropped, timers have no effect, and requests get no response."
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
    def on_tock(self):
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
    """Compare the ports and timers with the methods of the behavior."""
    for node, source in complete_behaviors(context):
        unbound = {method.name: method for method in unbound_handlers(node, source)}
        for handler in handlers(node):
            if handler.needed and source.method(handler.name) is None:
                yield _diagnostic(source, handler, unbound)


def _diagnostic(source: BehaviorSource, handler: Handler, unbound: dict[str, Method]) -> Diagnostic:
    signature = f"{handler.name}({', '.join(('self', *handler.arguments))})"
    close = nearest(handler.name, unbound)
    message = (
        f"{handler.kind} '{handler.of}' has no handler: "
        f"'{source.reference.class_name}' has no method '{handler.name}'"
    )
    if close is not None:  # a misspelled reference to the port
        label = Label(handler.of.span, f"the {handler.kind}")
        hint = f"rename '{close}' to '{handler.name}'"
        return Diagnostic(RULE, message, unbound[close].span, (label,), hint)
    span = source.class_span
    related = (Label(span, "the behavior class"),) if span is not None else ()
    return Diagnostic(RULE, message, handler.of.span, related, f"add 'def {signature}'")
