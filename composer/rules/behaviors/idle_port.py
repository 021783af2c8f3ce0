"""A timer, service or action server that does nothing."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.analysis.python.behaviors import handlers
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import ImplementationKind, Node, PortKind

RULE = register(
    Rule(
        code="RC438",
        name="idle-port",
        severity=Severity.WARNING,
        summary="A timer or server has neither a behavior nor a reaction.",
        why=(
            "The timer has no effect. The service returns an empty response to every request, "
            "which looks like a failure or, worse, like success."
        ),
        bad="""\
system: idle
nodes:
  planner:
    services: {reset: {type: std_srvs/srv/Trigger}}
""",
        good="""\
system: idle
nodes:
  planner:
    services: {reset: {type: std_srvs/srv/Trigger, respond: {success: true}}}
""",
    )
)

_DECLARATIVE = ImplementationKind.DECLARATIVE
_HINTS = {
    "timer": "add 'publish', 'call', 'set' or 'log'",
    PortKind.SERVICE.value: "add 'respond'",
    PortKind.ACTION_SERVER.value: "add 'result'",
}


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the nodes that have no behavior."""
    affected = context.once(earlier_errors).nodes
    for node in context.system.nodes:
        if (
            node.implementation is _DECLARATIVE
            and node.complete
            and node.name.value not in affected
        ):
            yield from _node(node)


def _node(node: Node) -> Iterator[Diagnostic]:
    for handler in handlers(node):
        if handler.needed and handler.kind in _HINTS:
            yield Diagnostic(
                RULE,
                f"{handler.kind} '{handler.of}' does nothing",
                handler.of.span,
                hint=_HINTS[handler.kind],
            )
