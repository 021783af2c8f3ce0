"""The fields of messages that reactions read and fill."""

from __future__ import annotations

import re
from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, error, warning
from composer.interfaces import Interfaces, Message
from composer.interfaces.field_types.constants import constant_problem, enumerator_problem
from composer.language.templates import Constant, Items, Record, Template
from composer.rules.analysis.context import Context
from composer.rules.analysis.expressions import message_templates
from composer.rules.types import certain_field_problems

UNKNOWN_FIELD = error("RC304", "unknown-field")
INVALID_VALUE = error("RC305", "invalid-value")
UNKNOWN_ENUMERATOR = warning("RC306", "unknown-enumerator")


def check_unknown_field(context: Context) -> Iterator[Diagnostic]:
    """Report the fields in YAML that do not exist."""
    for problem in certain_field_problems(context):
        if problem.missing:
            yield Diagnostic(
                UNKNOWN_FIELD,
                problem.message,
                problem.span,
                hint=problem.hint,
                subjects=(("field", problem.message),),
            )


def check_invalid_value(context: Context) -> Iterator[Diagnostic]:
    """Report the values in YAML that do not fit."""
    for problem in certain_field_problems(context):
        if not problem.missing:
            names = re.findall(r"\bparameters\.(\w+)", problem.span.text)
            yield Diagnostic(
                INVALID_VALUE,
                problem.message,
                problem.span,
                hint=problem.hint,
                relies_on=tuple(("parameter", name) for name in names),
            )


def check_unknown_enumerator(context: Context) -> Iterator[Diagnostic]:
    """Check the numbers that message fields are set to."""
    for template, message in message_templates(context):
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
