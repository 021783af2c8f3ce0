"""A reference to a node that the system does not have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.endpoints.references import endpoints
from composer.analysis.spans import part_of
from composer.diagnostics import Diagnostic, error, suggestion
from composer.model import Endpoint, Node

RULE = error(
    code="RC202",
    name="unknown-node",
    summary="A connection, a dependency or --set names a node that is not in this system.",
    why="The connection would have no effect, and the dependency could never be met.",
    bad="""\
system: dependency
nodes:
  planner: {on_activate: {log: ready}}
  motor_controller: {lifecycle: {depends_on: [planer]}}
""",
    good="""\
system: dependency
nodes:
  planner: {on_activate: {log: ready}}
  motor_controller: {lifecycle: {depends_on: [planner]}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the endpoints of connections, the dependencies of nodes, and the command line."""
    if context.is_partial:
        return
    for endpoint in endpoints(context.system):
        yield from _endpoint(context, endpoint)
    for node in context.system.nodes:
        yield from _dependencies(context, node)
    for unknown in context.system.unknown:
        yield Diagnostic(
            RULE,
            f"'{unknown.name}' is not a node of this system",
            unknown.name.span,
            hint=suggestion(unknown.name.value, unknown.known),
        )


def _endpoint(context: Context, endpoint: Endpoint) -> Iterator[Diagnostic]:
    name = endpoint.node
    if is_unresolved(endpoint.text.value) or context.system.node(name) is not None:
        return
    if not name:
        message = f"'{endpoint.text}' is not of the form 'node.port'"
        yield Diagnostic(RULE, message, endpoint.text.span)
        return
    yield Diagnostic(
        RULE,
        f"'{endpoint.text}' names node '{name}', which is not a node of this system",
        part_of(endpoint.text, 0, len(name)),
        hint=suggestion(name, context.once(_names)),
    )


def _dependencies(context: Context, node: Node) -> Iterator[Diagnostic]:
    for dependency in node.depends_on:
        name = dependency.node
        if is_unresolved(name.value) or context.system.node(name.value) is not None:
            continue
        yield Diagnostic(
            RULE,
            f"node '{node.name}' depends on '{name}', which is not a node of this system",
            name.span,
            hint=suggestion(name.value, context.once(_names)),
        )


def _names(context: Context) -> tuple[str, ...]:
    return tuple(node.name.value for node in context.system.nodes)
