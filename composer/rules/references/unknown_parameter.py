"""A parameter that the node does not declare."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.analysis.messages.expressions import expression_sites
from composer.analysis.spans import part_of_path
from composer.diagnostics import Diagnostic, Label, Severity, error, suggestion
from composer.model import Node
from composer.source import Span
from composer.spelling import is_typo

RULE = error(
    code="RC206",
    name="unknown-parameter",
    summary="A parameter that is not declared is set, or read by an expression.",
    why=(
        "A misspelled parameter leaves the real one at its default, which goes unnoticed "
        "until the robot moves at the wrong speed. A class, an executable or an external node "
        "may have parameters that it does not declare: without 'only_declared', only a "
        "probable misspelling is reported, as an info."
    ),
    bad="""\
system: parameters
nodes:
  source:
    type: timer_source
    variables: {message_type: std_msgs/msg/String}
    publishers: {output: {external: true}}
    parameters: {rate: 2.0}
""",
    good="""\
system: parameters
nodes:
  source:
    type: timer_source
    variables: {message_type: std_msgs/msg/String}
    publishers: {output: {external: true}}
    parameters: {rate_hz: 2.0}
""",
)


_RULE_IF_PASSED_ON = replace(RULE, severity=Severity.INFO)
_SEVERAL = 2
_SHOWN = 3


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the values that instances set and the parameters that expressions read."""
    first = {
        parameter.name.value: node
        for node in reversed(context.system.nodes)
        for parameter in node.parameters
    }
    for node in context.system.nodes:
        moved = _of_another_node(node, first)
        yield from _unknown(node) if moved is None else (moved,)
        yield from _misspelled(node)
    errors = context.once(earlier_errors)
    known = {
        node.name.value: [parameter.name.value for parameter in node.parameters]
        for node in context.system.nodes
    }
    names = {node: frozenset(declared) for node, declared in known.items()}
    for node_name, name, span in _uses(context, names):
        if name not in names[node_name] and not errors.may_declare(node_name, "parameters"):
            yield Diagnostic(
                RULE,
                f"the node does not declare parameter '{name}'",
                span,
                hint=suggestion(name, known[node_name]),
            )


def _misspelled(node: Node) -> Iterator[Diagnostic]:
    """Yield the parameters that are passed on, but named like one that is declared."""
    for undeclared in node.undeclared_parameters:
        name = undeclared.name
        known = (parameter.name.value for parameter in node.parameters)
        meant = next((other for other in known if is_typo(name.value, other)), None)
        if meant is not None:
            message = f"node '{node.name}' does not declare parameter '{name}'"
            hint = f"did you mean '{meant}'?"
            yield Diagnostic(_RULE_IF_PASSED_ON, message, name.span, hint=hint)


def _of_another_node(node: Node, first: Mapping[str, Node]) -> Diagnostic | None:
    """Return one report of several values that are all for the parameters of another node.

    ``first`` are the first nodes with parameters of these names.
    """
    unknown = [item for item in node.unknown if item.section == "parameters"]
    names = {item.name.value for item in unknown}
    if len(names) < _SEVERAL:
        return None
    other = first.get(unknown[0].name.value)
    if other is None or not all(other.parameter(name) for name in names):
        return None
    listed = " and ".join(f"'{item.name}'" for item in unknown[:_SEVERAL])
    labels = (Label(item.name.span, "nor this one") for item in unknown[1 : 1 + _SHOWN])
    return Diagnostic(
        RULE,
        f"node '{node.name}' has no parameters {listed}",
        unknown[0].name.span,
        tuple(labels),
        f"node '{other.name}' has them",
    )


def _unknown(node: Node) -> Iterator[Diagnostic]:
    """Yield the unknown names, and each parameter once that gets a map of names."""
    types = {item.name.value: item.type.value for item in node.parameters}
    maps: set[str] = set()
    for unknown in node.unknown:
        name = unknown.name.value
        first, dot, _ = name.partition(".")
        is_map = first in types and not any(other.startswith(f"{first}.") for other in types)
        if unknown.section != "parameters" or first in maps:
            continue
        if dot and is_map:
            maps.add(first)
            message = f"parameter '{first}' of node '{node.name}' is a {types[first]}, not a map"
            yield Diagnostic(RULE, message, unknown.name.span)
        else:
            yield Diagnostic(
                RULE,
                f"node '{node.name}' has no parameter '{name}'",
                unknown.name.span,
                hint=suggestion(name, unknown.known),
            )


def _uses(context: Context, known: Mapping[str, frozenset[str]]) -> Iterator[tuple[str, str, Span]]:
    for site in context.once(expression_sites):
        for path in site.expression.paths:
            if path.root == "parameters" and len(path.parts) > 1:
                span = part_of_path(site.span, site.expression, path, 1)
                node_name = site.node.name.value
                yield node_name, path.key(known[node_name]) or str(path.parts[1]), span
