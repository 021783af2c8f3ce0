"""A port that the node does not have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.earlier_errors import PORT_SECTIONS, earlier_errors
from composer.analysis.endpoints.references import endpoints
from composer.analysis.messages.reactions import sends
from composer.analysis.spans import part_of
from composer.diagnostics import Diagnostic, error, suggestion
from composer.model import Endpoint, Node, PortKind

RULE = error(
    code="RC203",
    name="unknown-port",
    summary="A connection, a reaction or a node with a type names a port that does not exist.",
    why="No data would flow: a port must be declared by the node or by its type.",
    bad="""\
system: ports
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
    timers: {tick: {period_ms: 1000, publish: {chattter: {data: hello}}}}
""",
    good="""\
system: ports
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
    timers: {tick: {period_ms: 1000, publish: {chatter: {data: hello}}}}
""",
)

_SECTIONS = frozenset(kind.section for kind in PortKind)
_SENDERS = {
    "publish": (PortKind.PUBLISHER,),
    "call": (PortKind.CLIENT, PortKind.ACTION_CLIENT),
}


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the ports that connections, chains, reactions and overrides refer to."""
    errors = context.once(earlier_errors)
    for endpoint in endpoints(context.system):
        if not errors.may_declare(endpoint.node, *PORT_SECTIONS):
            yield from _endpoint(context, endpoint)
    for site, key, send in sends(context.system):
        name = send.port
        if not site.node.complete or is_unresolved(name.value):
            continue
        if errors.may_declare(site.node.name.value, *PORT_SECTIONS):
            continue
        if site.node.port(name.value) is not None:
            continue
        candidates = [port.name.value for port in site.node.ports_of(*_SENDERS[key])]
        yield Diagnostic(
            RULE,
            f"'{key}' names port '{name}', which the node does not have",
            name.span,
            hint=suggestion(name.value, candidates),
        )
    for node in context.system.nodes:
        yield from _overrides(node)


def _endpoint(context: Context, endpoint: Endpoint) -> Iterator[Diagnostic]:
    node = context.system.node(endpoint.node)
    if node is None or not node.complete or node.port(endpoint.port) is not None:
        return
    name = endpoint.port
    if is_unresolved(endpoint.text.value):
        return
    yield Diagnostic(
        RULE,
        f"node '{node.name}' has no port '{name}'",
        part_of(endpoint.text, len(endpoint.node) + 1, len(name)),
        hint=suggestion(name, [port.name.value for port in node.ports]),
    )


def _overrides(node: Node) -> Iterator[Diagnostic]:
    for unknown in node.unknown:
        if unknown.section not in _SECTIONS:
            continue
        name = unknown.name
        other = node.port(name.value)
        hint = (
            f"'{name}' is declared under '{other.kind.section}'"
            if other is not None
            else suggestion(name.value, unknown.known)
        )
        yield Diagnostic(
            RULE,
            f"node type '{node.type_name}' has no port '{name}' under '{unknown.section}'",
            name.span,
            hint=hint,
        )
