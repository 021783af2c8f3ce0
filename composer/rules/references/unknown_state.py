"""A state variable that is not declared."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.analysis.messages.expressions import expression_sites
from composer.analysis.messages.reactions import reactions
from composer.analysis.spans import part_of_path
from composer.diagnostics import Diagnostic, Label, error, suggestion
from composer.model import Node
from composer.source import Span

RULE = error(
    code="RC210",
    name="unknown-state",
    summary="A reaction uses or sets a state variable that the node does not declare.",
    why="State variables are declared with their initial value, so that they always have one.",
    bad="""\
system: memory
nodes:
  counter:
    state: {last: 0.0}
    timers: {tick: {period_ms: 100, set: {lost: "{now}"}}}
""",
    good="""\
system: memory
nodes:
  counter:
    state: {last: 0.0}
    timers: {tick: {period_ms: 100, set: {last: "{now}"}}}
""",
)


#: Maximum number of further uses of a variable to show.
_SHOWN = 3


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the state that reactions set and expressions read."""
    errors = context.once(earlier_errors)
    known = {
        node.name.value: frozenset(name.value for name, _ in node.state)
        for node in context.system.nodes
    }
    unknown: dict[tuple[str, str], list[Span]] = {}
    nodes = {}
    for node, name, span in _uses(context):
        of_node = node.name.value
        if name not in known[of_node] and not errors.may_declare(of_node, "state"):
            nodes[of_node] = node
            unknown.setdefault((of_node, name), []).append(span)
    for (of_node, name), spans in unknown.items():
        first, *others = sorted(spans, key=lambda span: (span.file.path, span.line, span.column))
        names = [declared.value for declared, _ in nodes[of_node].state]
        hint = suggestion(name, names) or f"declare it: 'state: {{{name}: 0}}'"
        labels = tuple(Label(span, "also here") for span in others[:_SHOWN])
        yield Diagnostic(RULE, f"the node does not declare state '{name}'", first, labels, hint)


def _uses(context: Context) -> Iterator[tuple[Node, str, Span]]:
    for found in reactions(context.system):
        for name, _ in found.reaction.state:
            yield found.node, name.value, name.span
    for site in context.once(expression_sites):
        for path in site.expression.paths:
            if path.root == "state" and "state" in site.names and len(path.parts) > 1:
                span = part_of_path(site.span, site.expression, path, 1)
                yield site.node, str(path.parts[1]), span
