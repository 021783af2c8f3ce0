"""Checks what is iterated over and unpacked."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.fitting import shown
from composer.behavior_checks.messages.elements import parameter_read
from composer.behavior_checks.messages.lengths import length_of
from composer.behavior_checks.operations.operations import before_changes
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.objects import unpacked_tuple
from composer.behavior_types.functions import is_function
from composer.behavior_types.libraries.standard_types import is_asynchronous
from composer.behavior_types.scalars import is_byte, is_number, is_text
from composer.behavior_types.syntax.own_classes import known_attributes
from composer.behavior_types.values import (
    Collection,
    ModuleFunction,
    OwnObject,
    Value,
    pair,
)
from composer.field_types import ANYTHING, BOOL
from composer.interfaces import FieldType, Message

#: In how many lines after an assignment a name may be missing because of it.
_REACH = 20
#: Functions whose first argument is iterated over.
_ITERATING = frozenset(
    {"all", "any", "collections.deque", "enumerate", "frozenset", "itertools.pairwise", "list"}
    | {"reversed", "set", "sorted", "sum", "tuple"}
)


def iteration_problems(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield why a loop, an assignment or a call cannot iterate over or unpack a value."""
    match node:
        case (
            ast.For(target=target, iter=iterated) | ast.comprehension(target=target, iter=iterated)
        ):
            if getattr(node, "is_async", 0):
                return
            yield from _iterated(iterated, scope)
            element = unpacked_tuple(scope, scope.element(scope.type_of(iterated)))
            yield from _unpacked(target, element, iterated, scope)
        case ast.Assign(
            targets=[ast.Tuple(elts=targets) | ast.List(elts=targets)],
            value=ast.Constant(value=str() | bytes() as text),
        ) if len(targets) == len(text):
            return
        case ast.Assign(targets=[target], value=value):
            found = unpacked_tuple(scope, scope.type_of(value))
            yield from _unpacked(target, found, value, scope)
        case ast.Call(func=function, args=arguments):
            name = scope.called_name(function)
            if (name in _ITERATING and arguments) or (name == "iter" and len(arguments) == 1):
                yield from _iterated(arguments[0], scope)
            elif name == "zip" or (name in {"min", "max"} and len(arguments) == 1):
                for argument in arguments:
                    yield from _iterated(argument, scope)
        case ast.Starred(value=value):
            yield from _iterated(value, scope)
        case ast.AugAssign(target=ast.expr() as target, op=ast.Add(), value=value):
            changed = scope.type_of(target)
            changed = before_changes(target, scope) if changed is ANYTHING else changed
            is_list = isinstance(changed, Collection) and changed.python is list
            # numpy adds a number to each element of an array
            is_field = isinstance(changed, FieldType) and changed.is_array
            if is_list or (is_field and isinstance(scope.type_of(value), Message)):
                yield from _iterated(value, scope, "added to a list")


def _iterated(
    node: ast.expr, scope: FunctionTypes, what: str = "iterated over"
) -> Iterator[CodeProblem]:
    found = scope.type_of(node)
    if is_asynchronous(found):
        span = span_of(node, scope.home.source)
        problem = "an async generator cannot be iterated over by 'for'"
        yield CodeProblem(Kind.VALUE, problem, span, "write 'async for'")
    elif is_scalar(found):
        problem = f"{shown(found)} cannot be {what}"
        span = span_of(node, scope.home.source)
        yield CodeProblem(Kind.VALUE, problem, span, about=dotted(node))


def is_scalar(type_: Value) -> bool:
    """Return whether a value has no elements: a number, a message, a function or a plain object."""
    if isinstance(type_, ModuleFunction):  # a decorator may make anything of it
        return not type_.node.decorator_list
    if is_function(type_):
        return True
    if isinstance(type_, OwnObject):
        known = known_attributes(type_.of)
        return known is not None and not {"__iter__", "__getitem__"} & known
    return is_number(type_) or type_ == BOOL or isinstance(type_, Message) or is_byte(type_)


def _unpacked(
    target: ast.expr, found: Value, origin: ast.expr, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Check a tuple of targets against the value that is unpacked into it."""
    if not isinstance(target, ast.Tuple | ast.List):
        return
    if any(isinstance(item, ast.Starred) for item in target.elts):
        return
    wrong = _wrong_count(found, len(target.elts))
    if isinstance(origin, ast.List) and scope.type_of(origin) is found and not _stars(origin):
        wrong = _wrong_count(pair(*map(scope.type_of, origin.elts)), len(target.elts))
    if wrong is None and scope.type_of(origin) is found:
        wrong = _wrong_length(origin, len(target.elts), scope)
    if wrong is not None:
        span = span_of(origin, scope.home.source)
        lines = (span.line, span.line + _REACH)
        yield CodeProblem(Kind.VALUE, wrong, span, _hint(origin, found, scope), lines=lines)
        return
    items = found.items if isinstance(found, Collection) else None
    for item, type_ in zip(target.elts, items or (), strict=False):
        yield from _unpacked(item, type_, origin, scope)


def _stars(node: ast.List) -> bool:
    return any(isinstance(item, ast.Starred) for item in node.elts)


def _wrong_count(found: Value, count: int) -> str | None:
    if isinstance(found, Collection) and found.items is not None and len(found.items) != count:
        return f"{len(found.items)} values are unpacked into {count} names"
    if is_text(found) or is_scalar(found):
        return f"{shown(found)} is unpacked into {count} names"
    return None


def _wrong_length(origin: ast.expr, count: int, scope: FunctionTypes) -> str | None:
    """Return why a list whose length an expression shows is not unpacked into that many names."""
    if isinstance(scope.type_of(origin), FieldType) or parameter_read(origin, scope) is not None:
        return None  # it has a rule of its own
    least, most = length_of(origin, scope)
    if least <= count and (most is None or count <= most):
        return None
    values = f"{least}" if least == most else f"at least {least}"
    values = f"at most {most}" if most is not None and most < count and least != most else values
    return f"{values} values are unpacked into {count} names"


def _hint(origin: ast.expr, found: Value, scope: FunctionTypes) -> str | None:
    whole = scope.type_of(origin)
    is_dict = isinstance(whole, Collection) and whole.python is dict
    return "write .items() to get keys and values" if is_dict and is_text(found) else None
