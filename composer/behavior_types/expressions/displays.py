"""The types of operations, and of lists, dicts and comprehensions."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Sequence
from types import GeneratorType
from typing import TYPE_CHECKING

from composer.behavior_types.expressions.operators import both, comparison, unary
from composer.behavior_types.expressions.protocols import calculated
from composer.behavior_types.values import NONE, Collection, Value, join_all
from composer.field_types import ANYTHING

if TYPE_CHECKING:
    from composer.behavior_types.expressions.function_types import FunctionTypes


def computed(scope: FunctionTypes, node: ast.expr) -> Value:
    """Return the type of an operation, or of a collection."""
    match node:
        case ast.BinOp(left=left, op=operator, right=right):
            return calculated(scope, scope.type_of(left), operator, scope.type_of(right))
        case ast.UnaryOp(op=operator, operand=operand):
            return unary(operator, scope.type_of(operand))
        case ast.Compare(left=left, ops=operators, comparators=others):
            return comparison(operators, [scope.type_of(item) for item in (left, *others)])
        case ast.BoolOp(op=operator, values=values):
            return both(operator, [scope.type_of(value) for value in values])
        case ast.List(elts=items):
            return Collection(list, _common(scope, items), is_empty=not items)
        case ast.Tuple(elts=items):
            types = tuple(scope.type_of(item) for item in items)
            # '()' is often the place of another tuple
            is_open = not items or any(isinstance(item, ast.Starred) for item in items)
            return Collection(tuple, join_all(types), items=None if is_open else types)
        case ast.GeneratorExp(elt=item):
            return Collection(GeneratorType, scope.type_of(item))
        case ast.Starred(value=value):
            return scope.element(scope.type_of(value))
        case ast.Set(elts=items):
            return Collection(set, _common(scope, items))
        case ast.Dict(keys=keys, values=values):
            common = _of_record(scope, values), _common(scope, keys)
            return Collection(dict, *common, is_empty=not values)
        case ast.ListComp(elt=item):
            return Collection(list, scope.type_of(item))
        case ast.SetComp(elt=item):
            return Collection(set, scope.type_of(item))
        case ast.DictComp(key=key, value=value):
            return Collection(dict, scope.type_of(value), scope.type_of(key))
        case _:
            return ANYTHING


def _common(scope: FunctionTypes, items: Iterable[ast.expr | None]) -> Value:
    """Return the type of all of the items, ANYTHING if they differ."""
    return join_all(ANYTHING if item is None else scope.type_of(item) for item in items)


def _of_record(scope: FunctionTypes, values: Sequence[ast.expr]) -> Value:
    """Return the type of the values of a dict; None is the place of a value of any type."""
    is_open = any(scope.type_of(value) is NONE for value in values)
    return ANYTHING if is_open else _common(scope, values)
