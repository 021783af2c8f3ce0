"""Timers and servers of nodes without a behavior that do nothing."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.diagnostics import Diagnostic, warning
from composer.model import ImplementationKind, Node, PortKind
from composer.python_code.nodes.behaviors import handlers

_IDLE = """\
system: idle
nodes:
  planner:
    services: {reset: {type: std_srvs/srv/Trigger%s}}
"""
RULE = warning(
    code="RC438",
    name="idle-port",
    summary="A timer or server has neither a behavior nor a reaction.",
    why=(
        "The timer has no effect. The service returns an empty response to every request, "
        "which looks like a failure or, worse, like success."
    ),
    bad=_IDLE % "",
    good=_IDLE % ", respond: {success: true}",
)

#: What a node without a behavior can do instead, by the kind of its port or timer.
_REACTIONS = {
    "timer": "add 'publish', 'call', 'set' or 'log'",
    PortKind.SERVICE.value: "add 'respond'",
    PortKind.ACTION_SERVER.value: "add 'result'",
}


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the nodes that have neither a behavior nor another implementation."""
    affected = context.once(earlier_errors).nodes
    for node in context.system.nodes:
        is_declarative = node.implementation is ImplementationKind.DECLARATIVE
        if is_declarative and node.complete and node.name.value not in affected:
            yield from _idle_ports(node)


def _idle_ports(node: Node) -> Iterator[Diagnostic]:
    for handler in handlers(node):
        if handler.needed and handler.kind in _REACTIONS:
            message = f"{handler.kind} '{handler.of}' does nothing"
            hint = _REACTIONS[handler.kind]
            yield Diagnostic(RULE, message, handler.of.span, hint=hint)
