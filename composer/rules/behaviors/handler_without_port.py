"""A handler that is never called."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import a
from composer.analysis.python.behaviors import complete_behaviors, handlers, unbound_handlers
from composer.diagnostics import Diagnostic, Label, Rule, Severity, nearest, register, suggestion
from composer.model import Node

RULE = register(
    Rule(
        code="RC434",
        name="handler-without-port",
        severity=Severity.ERROR,
        summary="A behavior has a handler for a port or timer that the node does not have.",
        why=(
            "Handlers bind by name: 'on_scan' is called for the port or timer 'scan'. Without "
            "one, the method is never called. A method that the code itself uses, as in "
            "on_feedback=self.on_progress, is not a handler."
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
        pass

    def on_message(self, message):
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
    """Compare the methods of behaviors with the ports and timers."""
    for node, source in complete_behaviors(context):
        known = list(handlers(node))
        missing = {
            handler.name
            for handler in known
            if handler.needed and source.method(handler.name) is None
        }
        for method in unbound_handlers(node, source):
            if nearest(method.name, missing) is not None:
                continue  # shown by the diagnostic about the missing handler
            yield Diagnostic(
                RULE,
                f"handler '{method.name}' of '{source.reference.class_name}' matches no port or "
                "timer",
                method.span,
                (Label(source.reference.text.span, "the behavior of this node"),),
                _hint(node, method.name, [handler.name for handler in known]),
            )


def _hint(node: Node, name: str, known: list[str]) -> str | None:
    stem = name.removeprefix("on_").removeprefix("accept_")
    port = node.port(stem)
    if port is not None:
        return f"'{stem}' is {a(port.kind)}, which has no such handler"
    return suggestion(name, known)
