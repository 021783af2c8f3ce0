"""Constants and lists that do not fit the fields of messages, and wrong indices."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.base.diagnostics import suggestion
from composer.interfaces import FLOATS, TEXTS, Field, FieldType, Message
from composer.interfaces.field_types.constants import (
    constant_problem,
    enumerator_problem,
    enumerators,
)
from composer.python_code.checks.scopes import NodeScope
from composer.python_code.problems import Family, Problem
from composer.python_code.trees import dotted, span_of


def message_problems(scope: NodeScope) -> Iterator[Problem]:
    """Yield what is assigned to the fields of messages, or compared with them, and does not fit."""
    for node in scope.nodes:
        match node:
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    if isinstance(target, ast.Attribute):
                        yield from _field_problems(scope.field(target), value, scope)
                    elif isinstance(target, ast.Subscript):
                        yield from _value_problems(value, scope.type(target), scope)
            case ast.Call(func=function, keywords=[_, *_] as keywords):
                message = scope.message_class(function)
                if message is not None:
                    yield from _keyword_problems(message, keywords, scope)
            case ast.Subscript(value=owner, slice=index):
                yield from _index_problem(owner, index, scope)
            case ast.Compare(
                left=left,
                ops=[ast.Eq() | ast.NotEq() | ast.In() | ast.NotIn()],
                comparators=[right],
            ):
                yield from _comparison(left, getattr(right, "elts", [right]), scope)
                yield from _comparison(right, [left], scope)


def _keyword_problems(
    message: Message, keywords: list[ast.keyword], scope: NodeScope
) -> Iterator[Problem]:
    for keyword in keywords:
        field = message.field(keyword.arg or "")
        if field is not None:
            yield from _field_problems((message, field), keyword.value, scope)


def _field_problems(
    found: tuple[Message, Field] | None, node: ast.expr, scope: NodeScope
) -> Iterator[Problem]:
    if found is None:
        return
    problems = list(_value_problems(node, found[1].type, scope))
    yield from problems or _enumerator_problem(*found, node, scope)
    if found[1].name.endswith("frame_id"):
        yield from _frame_problem(node, scope)


def _frame_problem(node: ast.expr, scope: NodeScope) -> Iterator[Problem]:
    """Yield a frame ID with a slash: a constant, or the value of a parameter where it is set."""
    value, span = scope.constant(node), span_of(node, scope.source)
    name = dotted(node)
    for parameter in scope.code.node.parameters if name.startswith("self.parameters.") else ():
        if name == f"self.parameters.{parameter.name.value}" and parameter.value is not None:
            value, span = str(parameter.value.value), parameter.value.span
    if isinstance(value, str) and value.startswith("/"):
        message = f"frame ID '{value}' begins with a slash"
        yield Problem(Family.FRAME, message, span, "remove the slash")


def _value_problems(node: ast.expr, type_: object, scope: NodeScope) -> Iterator[Problem]:
    """Yield why an expression does not fit a field or an element of ``type_``."""
    if not isinstance(type_, FieldType):
        return
    if isinstance(node, ast.IfExp):
        for part in (node.body, node.orelse):
            if not isinstance(part, ast.IfExp):  # they may be nested deeply
                yield from _value_problems(part, type_, scope)
    elif type_.is_array:
        yield from _array_problems(node, type_, scope)
    else:
        value = scope.constant(node)
        # In Python, values of type byte are bytes, and those of type bool are integers.
        if value is None or isinstance(value, bool | bytes) or type_.name in ("bool", "byte"):
            return
        found = constant_problem(value, type_, scope.code.interfaces)
        if not type_.is_primitive:
            found = (f"{value} where {type_} is expected", None)
        elif isinstance(value, int) and type_.name in FLOATS:
            found = (f"{type_} must be a float, not the integer {value}", f"write {value}.0")
        if found is not None:
            yield scope.problem(Family.VALUE, found[0], node, found[1])


def _array_problems(node: ast.expr, type_: FieldType, scope: NodeScope) -> Iterator[Problem]:
    count = _length(node, scope)
    size, bound = type_.array_size, type_.array_bound
    if count is not None and (
        (size is not None and count != size) or (bound is not None and count > bound)
    ):
        elements = f"{count} element" + ("" if count == 1 else "s")
        yield scope.problem(Family.VALUE, f"{elements} where {type_} is expected", node)
        return
    items = [node.elt] if isinstance(node, ast.ListComp) else getattr(node, "elts", ())
    for item in items if isinstance(node, ast.List | ast.Tuple | ast.ListComp) else ():
        problem = next(_value_problems(item, type_.element, scope), None)
        if problem is not None:
            yield problem
            return  # the others have the same cause


def _length(node: ast.expr, scope: NodeScope) -> int | None:
    """Return the number of elements of a list, None if only running the code shows it."""
    match node:
        case ast.List(elts=items) | ast.Tuple(elts=items):
            is_open = any(isinstance(item, ast.Starred) for item in items)
            return None if is_open else len(items)
        case ast.BinOp(left=ast.List() as repeated, op=ast.Mult(), right=factor):
            length, times = _length(repeated, scope), scope.constant(factor)
            return length * times if length is not None and isinstance(times, int) else None
        case ast.Attribute():
            array = scope.type(node)
            return array.array_size if isinstance(array, FieldType) else None
    return None


def _index_problem(owner: ast.expr, index: ast.expr, scope: NodeScope) -> Iterator[Problem]:
    at = scope.constant(index)
    array = scope.type(owner) if isinstance(at, int) else None
    size = array.array_size if isinstance(array, FieldType) else None
    if isinstance(at, int) and size is not None and not -size <= at < size:
        hint = f"indices count from 0, so the last one is {size - 1}"
        yield scope.problem(Family.INDEX, f"{array} has no element {at}", index, hint)


def _comparison(left: ast.expr, others: list[ast.expr], scope: NodeScope) -> Iterator[Problem]:
    """Yield the values that a field never has, among those that it is compared with."""
    found = scope.field(left) if isinstance(left, ast.Attribute) else None
    if found is None or found[1].type.is_array or not found[1].type.is_primitive:
        return
    type_ = found[1].type
    is_text = type_.name in TEXTS
    for other in others:
        value = scope.constant(other)
        if isinstance(value, str) and not is_text:
            yield scope.doubt(f"{type_} is never equal to a string", other)
        elif isinstance(value, int | float) and (is_text or type_.name == "byte"):
            yield scope.doubt(f"{type_} is never equal to a number", other)
        else:
            yield from _enumerator_problem(*found, other, scope)


def _enumerator_problem(
    message: Message, field: Field, node: ast.expr, scope: NodeScope
) -> Iterator[Problem]:
    """Yield why a value is none of the constants for a field."""
    if field.type.is_array:
        return
    found = enumerator_problem(message, field.name, scope.constant(node))
    owner = scope.message_class(node.value) if isinstance(node, ast.Attribute) else None
    if found is not None:
        yield scope.doubt(found[0], node, found[1])
    elif isinstance(node, ast.Attribute) and owner is not None:
        known = enumerators(message, field.name)
        if (
            known
            and node.attr not in known
            and any(item.name == node.attr for item in owner.constants)
        ):
            text = f"{owner.name} defines {node.attr} for another field than '{field.name}'"
            yield scope.doubt(text, node, suggestion(node.attr, known))
