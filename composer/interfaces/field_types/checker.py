"""Checks templates, strings and conditions against the types of message fields."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from composer.base.diagnostics import Diagnostic, nearest, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import FieldType, Interfaces, Message
from composer.interfaces.field_types.inference import infer, literal_integer
from composer.interfaces.field_types.types import (
    ANYTHING,
    STRING,
    Scope,
    ValueType,
    constant_problem,
    described,
    fields_of,
    is_array,
    is_bool,
    is_integer,
    is_number,
    is_seconds,
    is_string,
    problem_at,
    type_of,
)
from composer.language.expressions import Expression
from composer.language.templates import Computed, Constant, Formatted, Items, Record, Template, Text


@dataclass(frozen=True, slots=True)
class FieldChecker:
    """Checks templates and expressions that use the names in ``scope``."""

    interfaces: Interfaces
    scope: Scope

    def template(self, template: Template, message: Message) -> Iterator[Diagnostic]:
        """Yield the problems of filling ``message`` from ``template``."""
        match template:
            case Record():
                yield from self._record(template, message)
            case Computed(expression=expression, span=span):
                yield from self._computed(expression, span, message)
            case Constant(value=str() as text) if "${" in text:
                return
            case Constant() | Text() | Items():
                names = ", ".join(message.field_names) or "none"
                problem = f"{message.name} must be a map of its fields"
                yield problem_at(template.span, problem, f"fields: {names}")

    def text(self, template: Template) -> Iterator[Diagnostic]:
        """Yield the problems of the expressions in a template of any type."""
        match template:
            case Computed(expression=expression, span=span):
                yield from self.expression(expression, span)
            case Text(parts=parts):
                for part in parts:
                    if isinstance(part, Formatted):
                        yield from self._formatted(part)
            case Record(fields=fields):
                for _, content in fields:
                    yield from self.text(content)
            case Items(items=items):
                for item in items:
                    yield from self.text(item)

    def type_of(self, template: Template) -> ValueType:
        """Return the type of the value that a template gives, as far as it is known."""
        match template:
            case Constant(value=value):
                return type_of(value)
            case Computed(expression=expression, span=span):
                return self._infer(expression, span)[0]
            case Text():
                return STRING
            case Record(fields=fields):
                return {name.value: self.type_of(content) for name, content in fields}
            case Items():
                return ANYTHING

    def condition(self, expression: Expression, span: Span) -> Iterator[Diagnostic]:
        """Yield the problems of an expression that must be a bool."""
        found, problems = self._infer(expression, span)
        yield from problems
        if found is not ANYTHING and not is_bool(found):
            message = f"a condition must be a bool, not {described(found)}"
            hint = "compare it, as in '... > 0'" if is_number(found) else None
            yield problem_at(span, message, hint)

    def number(self, expression: Expression, span: Span) -> Iterator[Diagnostic]:
        """Yield the problems of an expression that must be a number."""
        found, problems = self._infer(expression, span)
        yield from problems
        if found is not ANYTHING and not is_number(found):
            yield problem_at(span, f"{described(found)} where a number is expected")

    def expression(self, expression: Expression, span: Span) -> Iterator[Diagnostic]:
        """Yield the problems of an expression."""
        yield from self._infer(expression, span)[1]

    def _formatted(self, part: Formatted) -> Iterator[Diagnostic]:
        found, problems = self._infer(part.expression, part.span)
        yield from problems
        if part.format and not _can_format(found, part.format):
            yield problem_at(
                part.span, f"{described(found)} cannot be formatted as '{part.format}'"
            )

    def _infer(self, expression: Expression, span: Span) -> tuple[ValueType, list[Diagnostic]]:
        return infer(expression, span, self.scope, self.interfaces)

    def _record(self, record: Record, message: Message) -> Iterator[Diagnostic]:
        for name, content in record.fields:
            field = message.field(name.value)
            if field is None:
                problem = f"{message.name} has no field '{name.value}'"
                hint = suggestion(name.value, message.field_names)
                yield problem_at(name.span, problem, hint, missing=True)
                yield from self.text(content)
            else:
                for found in self._field(content, field.type):
                    hint = found.hint or _named_value(content, message, name.value)
                    yield replace(found, hint=hint)

    def _field(self, template: Template, type_: FieldType) -> Iterator[Diagnostic]:
        match template:
            case Constant(value=str() as text) if "${" in text:
                return
            case Constant(value=value, span=span):
                problem = constant_problem(value, type_, self.interfaces)
                if problem is not None:
                    yield problem_at(span, problem[0], problem[1])
            case Computed(expression=expression, span=span):
                number = literal_integer(expression) if is_integer(type_) else None
                if number is not None:
                    yield from self._field(Constant(number, span), type_)
                else:
                    yield from self._computed(expression, span, type_)
            case Text():
                yield from self._text(template, type_)
            case Record(span=span):
                yield from self._nested(template, type_, span)
            case Items():
                yield from self._items(template, type_)

    def _text(self, text: Text, type_: FieldType) -> Iterator[Diagnostic]:
        yield from self.text(text)
        if not is_string(type_):
            hint = 'write a single expression: "{...}"'
            yield problem_at(text.span, f"a string where {type_} is expected", hint)
        least = sum(len(part) for part in text.parts if isinstance(part, str))
        if type_.string_bound is not None and least > type_.string_bound:
            message = f"a string of at least {least} characters does not fit {type_}"
            yield problem_at(text.span, message)

    def _nested(self, record: Record, type_: FieldType, span: Span) -> Iterator[Diagnostic]:
        if type_.is_primitive or type_.is_array:
            yield from self.text(record)
            yield problem_at(span, f"a map of fields where {type_} is expected")
            return
        message = self.interfaces.message(type_.name)
        if message is not None:
            yield from self._record(record, message)

    def _items(self, items: Items, type_: FieldType) -> Iterator[Diagnostic]:
        if not type_.is_array:
            yield from self.text(items)
            yield problem_at(items.span, f"a list where {type_} is expected")
            return
        count = len(items.items)
        if type_.array_size not in (None, count) or (
            type_.array_bound is not None and count > type_.array_bound
        ):
            yield problem_at(items.span, f"a list of {count} elements does not fit {type_}")
        found = [list(self._field(item, type_.element)) for item in items.items]
        if len(found) > 1 and all(found) and all(isinstance(i, Constant) for i in items.items):
            first = found[0][0]  # the type of the field is not the one that the list is for
            yield replace(first, message=f"{first.message}, as in all {len(found)} elements")
        else:
            yield from (problem for problems in found for problem in problems)

    def _computed(
        self, expression: Expression, span: Span, target: FieldType | Message
    ) -> Iterator[Diagnostic]:
        found, problems = self._infer(expression, span)
        yield from problems
        if not problems and not self.fits(found, target):
            problem = f"{described(found)} where {described(target)} is expected"
            yield problem_at(span, problem, _conversion_hint(expression, found, target))

    def fits(self, found: ValueType, target: FieldType | Message) -> bool:
        """Return whether values of type ``found`` can be assigned to ``target``."""
        if found is ANYTHING:
            return True
        if is_array(target):
            return _fits_array(found, target)
        if not isinstance(target, Message) and target.is_primitive:
            return _fits_primitive(found, target)
        if is_seconds(target) and is_number(found):
            return True
        found_message, target_message = (
            fields_of(type_, self.interfaces) for type_ in (found, target)
        )
        if found_message is None or target_message is None:  # an untyped map, or an unknown message
            return not isinstance(found, FieldType) or _same_name(found, target)
        return found_message.name == target_message.name


def _named_value(template: Template, message: Message, field: str) -> str | None:
    """Return a hint for a text that names a constant of the message, with or without a prefix."""
    if not isinstance(template, Constant) or not isinstance(template.value, str):
        return None
    every = {item.name: item.value for item in message.constants}
    prefix = f"{field.upper()}_"
    known = {name: value for name, value in every.items() if name.startswith(prefix)} or every
    text = template.value.upper()
    ending = [name for name in known if name == text or name.endswith(f"_{text}")]
    short = {name.removeprefix(prefix): name for name in known}
    close = nearest(text, short)
    name = ending[0] if ending else short[close] if close is not None else None
    return f"write {known[name]}, the value of {name}" if name is not None else None


def _can_format(type_: ValueType, format_spec: str) -> bool:
    """Return whether Python can format a value of the type; True if it is unknown."""
    if type_ is ANYTHING:
        return True
    samples = ((is_integer, 1), (is_number, 1.0), (is_string, "text"), (is_bool, True))
    sample = next((value for belongs, value in samples if belongs(type_)), ())
    try:
        format(sample, format_spec)
    except (TypeError, ValueError):
        return False
    return True


def _fits_array(found: ValueType, target: ValueType) -> bool:
    if not isinstance(found, FieldType) or not isinstance(target, FieldType) or not found.is_array:
        return False
    (found_minimum, found_maximum), (minimum, maximum) = _lengths(found), _lengths(target)
    if found_minimum > maximum or found_maximum < minimum:
        return False
    if target.is_primitive:
        return _fits_primitive(found.element, target.element)
    return found.name == target.name


def _lengths(array: FieldType) -> tuple[float, float]:
    """Return the minimum and maximum number of elements of an array."""
    if array.array_size is not None:
        return array.array_size, array.array_size
    return 0, math.inf if array.array_bound is None else array.array_bound


def _fits_primitive(found: ValueType, target: FieldType) -> bool:
    if is_integer(target):
        return is_integer(found)
    return any(belongs(target) and belongs(found) for belongs in (is_number, is_string, is_bool))


def _same_name(found: FieldType, target: FieldType | Message) -> bool:
    return found.name == target.name and not found.is_array


def _conversion_hint(
    expression: Expression, found: ValueType, target: FieldType | Message
) -> str | None:
    source = expression.source
    if is_integer(target) and (is_number(found) or is_string(found)):
        return f"use {{{'round' if is_number(found) else 'int'}({source})}}"
    if is_string(target) and (is_number(found) or is_bool(found)):
        return f"use {{str({source})}}"
    if is_number(target) and is_string(found):
        return f"use {{float({source})}}"
    return None
