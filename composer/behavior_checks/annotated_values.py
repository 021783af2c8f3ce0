"""Checks values against the annotations of arguments, attributes and names."""

from __future__ import annotations

import ast
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence

from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_types.scalars import is_float, is_integer
from composer.behavior_types.syntax.lineage import is_derived
from composer.behavior_types.syntax.own_classes import is_enumeration, known_attributes
from composer.behavior_types.values import (
    AnyFunction,
    ApiValue,
    Collection,
    OwnObject,
    Pending,
    Value,
)
from composer.interfaces import FieldType, Message


def argument_problem(
    node: ast.expr | None, found: Value, expected: Value, type_of: Callable[[ast.expr], Value]
) -> str | None:
    """Return why a value contradicts an annotation, None if it may fit.

    Numbers fit numbers and bools, as they do in Python. ``type_of`` gives the types of the items of
    a list.
    """
    if isinstance(node, ast.IfExp) or (
        isinstance(node, ast.BoolOp) and isinstance(node.op, ast.Or)
    ):
        return _first_problem(_parts(node, expected), type_of)
    kind, wanted = kind_of(found), kind_of(expected)
    if isinstance(expected, AnyFunction) and isinstance(found, Pending):
        return f"what '{found.name}' returns where a function is expected"
    if isinstance(expected, AnyFunction) and isinstance(found, OwnObject):
        known = known_attributes(found.of)
        if known is None or "__call__" in known:
            return None
    if "tuple" in (kind, wanted):
        # a tuple may take the place of a named tuple
        kinds = {kind, wanted} - {"tuple", "collection"}
        is_same = isinstance(found, OwnObject) and isinstance(expected, OwnObject)
        is_same = is_same and not any(map(_is_enumeration, (found, expected)))
        if None in kinds or not kinds or is_same:
            return None
        return f"{shown(found)} where {shown(expected)} is expected"
    if _are_related(found, expected):
        return None
    if isinstance(found, ApiValue) and isinstance(expected, Message | FieldType | Collection):
        return f"a {found.class_name} where {shown(expected)} is expected"
    is_enum = isinstance(expected, OwnObject) and is_enumeration(expected.of)
    if is_enum and is_float(found):  # an int may stand for a member of an IntEnum
        return f"{shown(found)} where {shown(expected)} is expected"
    if kind is not None and wanted is not None and kind != wanted:
        return f"{shown(found)} where {shown(expected)} is expected"
    if not isinstance(expected, Collection):
        return None
    wrong = _first_problem(_elements(node, expected), type_of)
    if wrong is not None:
        return wrong
    if isinstance(found, Collection) and expected.items is None and not found.is_empty:
        wrong = _element_problem(found, expected, type_of)
        if wrong is not None:
            return wrong
    if expected.items is not None and isinstance(found, Collection) and found.python is list:
        return f"a list where {shown(expected)} is expected"
    if expected.python is tuple and isinstance(found, Collection):
        return _tuple_problem(node, found, expected, type_of)
    return None


def _elements(node: ast.expr | None, expected: Collection) -> Iterator[tuple[ast.expr, Value]]:
    """Yield the elements that are written down, with the types that an annotation expects."""
    is_dict = issubclass(expected.python, dict)
    match node:
        case ast.List(elts=items) | ast.Tuple(elts=items) | ast.Set(elts=items):
            if expected.items is None and not is_dict:
                yield from ((item, expected.element) for item in items)
        case ast.ListComp(elt=item) | ast.SetComp(elt=item) if not is_dict:
            yield item, expected.element
        case ast.Dict(keys=keys, values=values) if is_dict:
            for key, value in zip(keys, values, strict=True):
                if key is not None:
                    yield key, expected.key
                    yield value, expected.element
        case ast.DictComp(key=key, value=value) if is_dict:
            yield key, expected.key
            yield value, expected.element


def _first_problem(
    items: Iterable[tuple[ast.expr, Value]], type_of: Callable[[ast.expr], Value]
) -> str | None:
    """Return why the first of several expressions contradicts what is expected of it."""
    found = (argument_problem(item, type_of(item), wanted, type_of) for item, wanted in items)
    return next((wrong for wrong in found if wrong is not None), None)


def _is_enumeration(type_: Value) -> bool:
    return isinstance(type_, OwnObject) and is_enumeration(type_.of)


_SEQUENCES = (deque, frozenset, list, set, tuple)


def _element_problem(
    found: Collection, expected: Collection, type_of: Callable[[ast.expr], Value]
) -> str | None:
    """Return why the elements of a collection contradict an annotation."""
    if found.python not in _SEQUENCES or expected.python not in (*_SEQUENCES, Iterable, Sequence):
        return None
    wrong = argument_problem(None, found.element, expected.element, type_of)
    return f"an element: {wrong}" if wrong is not None else None


def problem_place(
    node: ast.expr, expected: Value, type_of: Callable[[ast.expr], Value]
) -> ast.expr:
    """Return the part of an expression with a problem that contradicts what is expected of it."""
    for part, wanted in _parts(node, expected):
        if argument_problem(part, type_of(part), wanted, type_of) is not None:
            return problem_place(part, wanted, type_of)
    return node


def _parts(node: ast.expr | None, expected: Value) -> Iterator[tuple[ast.expr, Value]]:
    """Yield the values that an expression chooses from, or else the elements that it shows."""
    match node:
        case ast.IfExp(body=first, orelse=second):
            yield from ((first, expected), (second, expected))
        case ast.BoolOp(op=ast.Or(), values=values):
            yield from ((value, expected) for value in values)
        case _ if isinstance(expected, Collection):
            yield from _elements(node, expected)


def _are_related(found: Value, expected: Value) -> bool:
    """Return whether objects of one class may be of the other one."""
    if not isinstance(found, OwnObject) or not isinstance(expected, OwnObject):
        return False
    return is_derived(found.of, expected.of) or is_derived(expected.of, found.of)


def _tuple_problem(
    node: ast.expr | None,
    found: Collection,
    expected: Collection,
    type_of: Callable[[ast.expr], Value],
) -> str | None:
    if found.items is None or expected.items is None:
        return None
    if len(found.items) != len(expected.items):
        return f"{len(found.items)} values where {len(expected.items)} are expected"
    nodes = node.elts if isinstance(node, ast.Tuple) else [None] * len(found.items)
    for item, type_, wanted in zip(nodes, found.items, expected.items, strict=True):
        wrong = argument_problem(item, type_, wanted, type_of)
        if wrong is None and is_float(type_) and is_integer(wanted):
            wrong = f"{shown(type_)} where {shown(wanted)} is expected"
        if wrong is not None:
            return wrong
    return None
