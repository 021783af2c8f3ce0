"""Values that are worked out at run time: constants, ``{expressions}``, text and maps of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from composer.expressions import Expression
from composer.source import Located, Span
from composer.tree import ScalarValue


@dataclass(frozen=True, slots=True)
class Constant:
    """A literal."""

    value: ScalarValue
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Computed:
    """A string that is one ``{expression}``: it keeps the type of the value."""

    expression: Expression
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Formatted:
    """An ``{expression:format}`` within a text."""

    expression: Expression
    format: str


@dataclass(frozen=True, slots=True)
class Text:
    """A text with expressions in it."""

    parts: tuple[str | Formatted, ...]
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Record:
    """A map of field names to templates: a message, or a part of one."""

    fields: tuple[tuple[Located[str], Template], ...]
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Items:
    """A list of templates."""

    items: tuple[Template, ...]
    span: Span = field(compare=False)


Template: TypeAlias = "Constant | Computed | Text | Record | Items"
