"""The types of what functions without annotations return."""

from __future__ import annotations

import ast
from types import GeneratorType
from typing import TYPE_CHECKING

from composer.behavior_source import Function
from composer.behavior_source.flow import returned_values, yields
from composer.behavior_types.values import Collection, Value, join_all
from composer.field_types import ANYTHING

if TYPE_CHECKING:
    from composer.behavior_types.expressions.function_types import FunctionTypes

#: How many functions that call each other are followed.
_DEEPEST = 8


def inferred_result(inside: FunctionTypes, function: Function) -> Value:
    """Return the type of what a function returns; ``inside`` are the types within it.

    None is disregarded. A function that calls itself is not known.
    """
    owner = inside.owner
    if id(function) in owner.results:
        return owner.results[id(function)]
    if owner.depth >= _DEEPEST:
        return ANYTHING
    owner.results[id(function)] = ANYTHING
    owner.depth += 1
    try:
        owner.results[id(function)] = _returned(inside, function)
    finally:
        owner.depth -= 1
    return owner.results[id(function)]


def _returned(inside: FunctionTypes, function: Function) -> Value:
    yielded = list(yields(function))
    if yielded:
        given = [node.value for node in yielded if isinstance(node, ast.Yield)]
        is_known = len(given) == len(yielded) and None not in given
        types = [inside.type_of(value) for value in given if value is not None]
        return Collection(GeneratorType, _common(types) if is_known else ANYTHING)
    return _common([inside.type_of(value) for value in returned_values(function)])


def _common(types: list[Value]) -> Value:
    return ANYTHING if not types or ANYTHING in types else join_all(types)
