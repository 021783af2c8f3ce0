"""Constants and lists that do not fit the fields of messages."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.interfaces import Field, FieldType, Message
from composer.interfaces.field_types.constants import constant_problem, enumerator_problem
from composer.python_code.checks.scopes import NodeScope
from composer.python_code.problems import Family, Problem
from composer.python_code.trees import dotted, span_of

_EQUALITY = (ast.Eq, ast.NotEq, ast.In, ast.NotIn)


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
            case ast.Compare(left=left, ops=[operator], comparators=[right]):
                found = scope.field(left) if isinstance(operator, _EQUALITY) else None
                for other in getattr(right, "elts", [right]):
                    yield from _enumerator_problem(found, other, scope)


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
    yield from problems or _enumerator_problem(found, node, scope)
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
            yield from _value_problems(part, type_, scope)
    elif type_.is_array:
        yield from _array_problems(node, type_, scope)
    else:
        value = scope.constant(node)
        # In Python, values of type byte are bytes, and those of type bool are integers.
        is_number = type_.is_primitive and type_.name not in ("bool", "byte")
        if value is None or isinstance(value, bool | bytes) or not is_number:
            return
        found = constant_problem(value, type_, scope.code.interfaces)
        if found is not None:
            yield Problem(Family.VALUE, found[0], span_of(node, scope.source), found[1])


def _array_problems(node: ast.expr, type_: FieldType, scope: NodeScope) -> Iterator[Problem]:
    count = _length(node, scope)
    size, bound = type_.array_size, type_.array_bound
    if count is not None and (
        (size is not None and count != size) or (bound is not None and count > bound)
    ):
        elements = f"{count} element" + ("" if count == 1 else "s")
        message = f"{elements} where {type_} is expected"
        yield Problem(Family.VALUE, message, span_of(node, scope.source))
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
    return None


def _enumerator_problem(
    found: tuple[Message, Field] | None, node: ast.expr, scope: NodeScope
) -> Iterator[Problem]:
    """Yield why a value is none of the constants for a field; the code does not fail."""
    if found is None or found[1].type.is_array:
        return
    problem = enumerator_problem(found[0], found[1].name, scope.constant(node))
    if problem is not None:
        span = span_of(node, scope.source)
        yield Problem(Family.VALUE, problem[0], span, problem[1], is_certain=False)
