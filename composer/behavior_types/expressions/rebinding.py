"""The types of names that are bound several times."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from composer.behavior_types.expressions.operators import binary
from composer.behavior_types.syntax.bindings import How
from composer.behavior_types.values import NONE, Value, join
from composer.field_types import ANYTHING


def joined(found: Iterable[tuple[Value, How]]) -> Value:
    """Return the type of a name with these bindings; an annotation decides."""
    pairs = list(found)
    for type_, how in pairs:
        if how is How.ANNOTATION:
            return type_
    result: Value = NONE
    for type_, _ in pairs:
        result = join(result, type_)
    return result


def with_changes(type_: Value, changes: Iterable[tuple[ast.operator, Value]]) -> Value:
    """Return the type of a name after ``+=`` and the like; ANYTHING if they may change it."""
    for operator, value in changes:
        if binary(type_, operator, value) != type_:
            return ANYTHING
    return type_
