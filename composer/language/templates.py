"""Templates: values evaluated at run time, with ``{expression}`` in their texts.

In a text, ``{expression}`` is replaced by its value, and ``{expression:.2f}`` by its formatted
value (Python's format specification with at most two digits of width and precision). ``{{`` and
``}}`` are braces. A text with a single ``{expression}`` and nothing else keeps the type of the
value. A text with a ``${variable}`` without value is not changed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any, TypeAlias

from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language import tree
from composer.language.expressions import (
    EvaluationError,
    Expression,
    ExpressionError,
    compile_expression,
)
from composer.language.rules import INVALID_EXPRESSION
from composer.language.tree import ScalarValue, Tree

_FORMAT = re.compile(r"[<>^]?[-+ ]?#?0?\d{0,2},?(\.\d{1,2})?[bdeEfFgGoxX%s]?", re.ASCII)
_QUOTED = r"""'[^']*'?|"[^"]*"?"""
#: ``{{``, ``}}``, an expression up to the first ``}`` outside quotes, a lone brace, other text.
_PIECE = re.compile(rf"\{{\{{|\}}\}}|\{{(?:[^}}'\"]+|{_QUOTED})*\}}?|\}}|[^{{}}]+")
_SOURCE = re.compile(rf"(?:[^:'\"]+|{_QUOTED})*")
#: More of one template are not reported.
_MAX_PROBLEMS = 100
#: Expressions in one text, and the texts between them.
_MAX_PARTS = 1000
_FORMAT_HINT = "a format is like .2f, 5d, >10 or x"


@dataclass(frozen=True, slots=True)
class Constant:
    """A literal."""

    value: ScalarValue
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Computed:
    """A text that is one ``{expression}``, which keeps the type of its value."""

    expression: Expression
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Formatted:
    """An ``{expression:format}`` within a text."""

    expression: Expression
    format: str
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Text:
    """A text that contains expressions."""

    parts: tuple[str | Formatted, ...]
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Record:
    """A map of field names to templates: a message or a part of it."""

    fields: tuple[tuple[Located[str], Template], ...]
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Items:
    """A list of templates."""

    items: tuple[Template, ...]
    span: Span = field(compare=False)


Template: TypeAlias = "Constant | Computed | Text | Record | Items"


def compile_template(value: Tree) -> tuple[Template | None, list[Diagnostic]]:
    """Return the template that ``value`` describes, or None with all problems."""
    problems: list[Diagnostic] = []
    template = _compile(value, problems)
    return (None, problems) if problems else (template, [])


def evaluate(template: Template, scope: Mapping[str, Any]) -> Any:
    """Return the value of the template with the names in ``scope``.

    A Record becomes a dict, Items a list. Raises EvaluationError.
    """
    match template:
        case Constant(value=value):
            return value
        case Computed(expression=expression):
            return expression.evaluate(scope)
        case Text(parts=parts):
            return "".join(_text(part, scope) for part in parts)
        case Record(fields=fields):
            return {name.value: evaluate(content, scope) for name, content in fields}
        case Items(items=items):
            return [evaluate(item, scope) for item in items]


def expressions_in(template: Template) -> Iterator[tuple[Expression, Span]]:
    """Yield every expression of the template with the span of its text, without braces."""
    match template:
        case Computed(expression=expression, span=span):
            yield expression, span
        case Text(parts=parts):
            for part in parts:
                if isinstance(part, Formatted):
                    yield part.expression, part.span
        case Record(fields=fields):
            for _, content in fields:
                yield from expressions_in(content)
        case Items(items=items):
            for item in items:
                yield from expressions_in(item)


def _text(part: str | Formatted, scope: Mapping[str, Any]) -> str:
    if isinstance(part, str):
        return part
    value = part.expression.evaluate(scope)
    if not part.format:
        return str(value)
    try:
        return format(value, part.format)
    except (TypeError, ValueError, OverflowError):
        kind = type(value).__name__
        message = f"'{part.expression}': a {kind} cannot be written as '{part.format}'"
        raise EvaluationError(message) from None


def _compile(value: Tree, problems: list[Diagnostic]) -> Template:
    match value:
        case tree.Mapping():
            fields = tuple(
                (Located(entry.name, entry.key.span), _compile(entry.value, problems))
                for entry in value
            )
            return Record(fields, value.span)
        case tree.Sequence():
            return Items(tuple(_compile(item, problems) for item in value.items), value.span)
        case tree.Scalar(value=str() as text) if "${" not in text:
            return _compile_text(value, text, problems)
        case tree.Scalar():
            return Constant(value.value, value.span)


def _compile_text(scalar: tree.Scalar, text: str, problems: list[Diagnostic]) -> Template:
    parts: list[str | Formatted] = []
    for match in _PIECE.finditer(text):
        offset, piece = match.start(), match[0]
        if len(problems) >= _MAX_PROBLEMS:
            break
        if len(parts) > _MAX_PARTS:
            message = f"this text has more than {_MAX_PARTS} parts"
            problems.append(_problem(message, scalar.part(offset, 1)))
            break
        if piece in ("{{", "}}"):
            parts.append(piece[0])
        elif piece.startswith("{"):
            parts.extend(_compile_braces(scalar, offset, piece, problems))
        elif piece == "}":
            span = scalar.part(offset, 1)
            problems.append(_problem("'}' closes nothing", span, "write '}}' for a brace"))
        else:
            parts.append(piece)
    match parts:
        case []:
            return Constant(text, scalar.span)
        case [Formatted(expression=expression, format="", span=span)]:
            return Computed(expression, span)
        case _ if any(isinstance(part, Formatted) for part in parts):
            return Text(tuple(parts), scalar.span)
        case _:
            return Constant("".join(str(part) for part in parts), scalar.span)


def _compile_braces(
    scalar: tree.Scalar, offset: int, piece: str, problems: list[Diagnostic]
) -> list[str | Formatted]:
    if not piece.endswith("}"):
        span = scalar.part(offset, 1)
        problems.append(_problem("'{' is not closed", span, "write '{{' for a brace"))
        return []
    inside = piece[1:-1]
    # The format follows the first colon outside quotes.
    matched = _SOURCE.match(inside)
    source = matched[0] if matched is not None else ""
    layout = inside[len(source) + 1 :] if len(source) < len(inside) else None
    source_offset = offset + 1 + len(source) - len(source.lstrip())
    source = source.strip()
    if layout is not None and not (layout and _FORMAT.fullmatch(layout)):
        span = scalar.part(offset + piece.index(":" + layout) + 1, len(layout))
        problems.append(_problem(f"'{layout}' is not a format", span, _FORMAT_HINT))
        return []
    try:
        expression = compile_expression(source)
    except ExpressionError as error:
        span = scalar.part(source_offset + error.offset, error.length)
        problems.append(_problem(error.message, span, error.hint))
        return []
    return [Formatted(expression, layout or "", scalar.part(source_offset, len(source)))]


def _problem(message: str, span: Span, hint: str | None = None) -> Diagnostic:
    return Diagnostic(INVALID_EXPRESSION, message, span, hint=hint)
