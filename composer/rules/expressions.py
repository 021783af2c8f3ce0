"""Expressions and messages in reactions: names, indices, fields and their values."""

from __future__ import annotations

import re
from collections.abc import Iterator

from composer.base.characters import counted
from composer.base.diagnostics import Diagnostic, Label, error, suggestion, warning
from composer.base.fast_dataclass import replace
from composer.base.source import Span
from composer.interfaces import Interfaces, Message
from composer.interfaces.field_types.types import (
    UNKNOWN_FIELD,
    constant_problem,
    enumerator_problem,
)
from composer.language.expressions import FieldPath
from composer.language.templates import Constant, Items, Record, Template
from composer.model import Node
from composer.rules.analysis.context import Context, part_of_path
from composer.rules.analysis.expressions import (
    EVENT_NAMES,
    ExpressionSite,
    expression_sites,
    message_templates,
    reactions,
)
from composer.rules.analysis.subjects import earlier_errors
from composer.rules.types import certain_field_problems

UNKNOWN_NAME = error("RC209", "unknown-name")
INDEX_OUT_OF_RANGE = warning("RC308", "index-out-of-range")
UNKNOWN_ENUMERATOR = warning("RC306", "unknown-enumerator")
#: Maximum number of further uses of a variable to show.
_SHOWN_USES = 3


def check_unknown_name(context: Context) -> Iterator[Diagnostic]:
    """Check the first part of every path."""
    for site in context.once(expression_sites):
        for path in site.expression.paths:
            if path.root in site.names:
                continue
            yield Diagnostic(
                UNKNOWN_NAME,
                f"name '{path.root}' is not available here",
                part_of_path(site.span, site.expression, path),
                hint=_name_hint(path.root, site),
            )


def _name_hint(name: str, site: ExpressionSite) -> str | None:
    if site.node.parameter(name) is not None and "parameters" in site.names:
        return f"write 'parameters.{name}'"
    if any(known.value == name for known, _ in site.node.state) and "state" in site.names:
        return f"write 'state.{name}'"
    own = EVENT_NAMES.get(site.event) if site.event is not None else None
    if own and any(name in names for names in EVENT_NAMES.values()):
        return f"use '{own[0]}' here"
    return suggestion(name, site.names)


def check_unknown_state(context: Context) -> Iterator[Diagnostic]:
    """Check the state that reactions set and expressions read."""
    errors = context.once(earlier_errors)
    known = {
        node.name.value: frozenset(name.value for name, _ in node.state)
        for node in context.system.nodes
    }
    unknown: dict[tuple[str, str], list[Span]] = {}
    nodes = {}
    for node, name, span in _state_uses(context):
        of_node = node.name.value
        if name not in known[of_node] and not errors.may_declare(of_node, "state"):
            nodes[of_node] = node
            unknown.setdefault((of_node, name), []).append(span)
    for (of_node, name), spans in unknown.items():
        first, *others = sorted(spans, key=lambda span: (span.file.path, span.line, span.column))
        names = [declared.value for declared, _ in nodes[of_node].state]
        hint = suggestion(name, names) or f"declare it: 'state: {{{name}: 0}}'"
        labels = tuple(Label(span, "also here") for span in others[:_SHOWN_USES])
        yield Diagnostic(
            UNKNOWN_NAME, f"the node does not declare state '{name}'", first, labels, hint
        )


def _state_uses(context: Context) -> Iterator[tuple[Node, str, Span]]:
    for found in reactions(context.system):
        for name, _ in found.reaction.state:
            yield found.node, name.value, name.span
    for site in context.once(expression_sites):
        for path in site.expression.paths:
            if path.root == "state" and "state" in site.names and len(path.parts) > 1:
                span = part_of_path(site.span, site.expression, path, 1)
                yield site.node, str(path.parts[1]), span


def check_index_out_of_range(context: Context) -> Iterator[Diagnostic]:
    """Compare the indices in expressions with the initial values of the parameters."""
    for site in context.once(expression_sites):
        for path in site.expression.paths:
            yield from _out_of_range(site, path)


def _out_of_range(site: ExpressionSite, path: FieldPath) -> Iterator[Diagnostic]:
    if path.root != "parameters" or len(path.parts) != 3:
        return
    name, index = str(path.parts[1]), path.parts[2]
    parameter = site.node.parameter(name)
    if parameter is None or parameter.value is None or not isinstance(index, int):
        return
    value = parameter.value.value
    if isinstance(value, list) and not -len(value) <= index < len(value):
        yield Diagnostic(
            INDEX_OUT_OF_RANGE,
            f"parameter '{name}' has no element {index}: it has {counted(len(value), 'element')}",
            part_of_path(site.span, site.expression, path, 2),
            (Label(parameter.value.span, "its value"),),
            f"indices count from 0, so the last one is {len(value) - 1}" if value else None,
            relies_on=(("parameter", name),),
        )


def check_field(context: Context) -> Iterator[Diagnostic]:
    """Report the fields in YAML that do not exist, and the values that do not fit."""
    for problem in certain_field_problems(context):
        if problem.rule is UNKNOWN_FIELD:
            yield replace(problem, subjects=(("field", problem.message),))
        else:
            names = re.findall(r"\bparameters\.(\w+)", problem.primary.text)
            yield replace(problem, relies_on=tuple(("parameter", name) for name in names))


def check_unknown_enumerator(context: Context) -> Iterator[Diagnostic]:
    """Check the numbers that message fields are set to."""
    for template, message in context.once(message_templates):
        yield from _unknown_enumerators(template, message, context.interfaces)


def _unknown_enumerators(
    template: Template, message: Message, interfaces: Interfaces
) -> Iterator[Diagnostic]:
    if not isinstance(template, Record):
        return
    for name, content in template.fields:
        field = message.field(name.value)
        if field is None:
            continue
        nested = interfaces.message(field.type.name)
        for item in content.items if isinstance(content, Items) else (content,):
            if isinstance(item, Constant):
                if constant_problem(item.value, field.type.element, interfaces) is None:
                    yield from _unknown_enumerator(item, name.value, message)
            elif nested is not None:
                yield from _unknown_enumerators(item, nested, interfaces)


def _unknown_enumerator(constant: Constant, field: str, message: Message) -> Iterator[Diagnostic]:
    problem = enumerator_problem(message, field, constant.value)
    if problem is not None:
        yield Diagnostic(UNKNOWN_ENUMERATOR, problem[0], constant.span, hint=problem[1])
