"""Indices whose values are written down elsewhere, in lists of a known length."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.guards import OF_INDICES, asks_for_length, handles
from composer.behavior_checks.messages.elements import counted
from composer.behavior_checks.messages.lengths import length_of
from composer.behavior_checks.possible_constants import only_binding, passed
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.flow import returned_values
from composer.behavior_source.spans import span_of
from composer.behavior_source.traversal import children
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.bindings import Binding, How, nodes_of
from composer.behavior_types.syntax.literals import integer_constant
from composer.behavior_types.syntax.own_classes import is_enumeration, member_values
from composer.behavior_types.values import OwnClass, OwnMethod

_DEEPEST = 4
_MOST = 100


def index_problems(
    node: ast.Subscript, function: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield an index that a loop, a call or an enumeration gives, beyond the end of a list."""
    is_checked = integer_constant(node.slice) is None and not isinstance(node.ctx, ast.Del)
    if not is_checked or asks_for_length(function) or handles(function, OF_INDICES):
        return
    first = next(_values(node.slice, scope, _DEEPEST), None)
    count = length_of(node.value, scope)[1] if first is not None else None
    if not count:
        return
    for index in _values(node.slice, scope, _DEEPEST):
        if not -count <= index < count:
            owner = ast.unparse(node.value)
            message = f"'{owner}' has no element {index}: it has {counted(count)}"
            span = span_of(node.slice, scope.home.source)
            about = "" if isinstance(node.slice, ast.Name) else owner
            yield CodeProblem(Kind.INDEX, message, span, about=about)
            return


def _values(node: ast.expr, scope: FunctionTypes, depth: int) -> Iterator[int]:
    """Yield the integers that an expression has the value of in some calls."""
    constant = integer_constant(node)
    if constant is not None:
        yield constant
    if depth == 0:
        return
    match node:
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() as sign, right=right):
            change = integer_constant(right)
            if change is not None:
                change = change if isinstance(sign, ast.Add) else -change
                yield from (value + change for value in _values(left, scope, depth - 1))
        case ast.Attribute(value=owner, attr=name):
            own = scope.type_of(owner)
            if isinstance(own, OwnClass) and is_enumeration(own, "enum.IntEnum"):
                found = (member_values(own) or {}).get(name)
                yield from () if found is None else _values(found, scope, 0)
        case ast.Name(id=name) if scope.function is not None:
            binding = only_binding(node, scope)
            is_changed = name in scope.bindings.name_changes
            if binding is not None and not is_changed and not _is_tested(node, binding, scope):
                yield from _bound(node, binding, scope, depth - 1)
        case ast.Call(func=called):
            match scope.type_of(called):
                case OwnMethod(method=method, home=home) if method.node is not None:
                    inside = scope.owner.scope(method, home)
                    if inside is not None and method.known:
                        for value in returned_values(method.node):
                            yield from _values(value, inside, depth - 1)


def _bound(node: ast.Name, binding: Binding, scope: FunctionTypes, depth: int) -> Iterator[int]:
    if binding.how is How.ANNOTATION:
        for given, outside in passed(node, scope):
            yield from _values(given, outside, depth)
    elif binding.how is How.VALUE and binding.expression is not None and not binding.positions:
        yield from _values(binding.expression, scope, depth)
    elif binding.how is How.ELEMENT and binding.expression is not None:
        yield from _elements(binding.expression, binding.positions, scope, depth)


def _elements(
    node: ast.expr, positions: tuple[int, ...], scope: FunctionTypes, depth: int
) -> Iterator[int]:
    """Yield the integers at a position in the elements of what is iterated over."""
    own = scope.type_of(node)
    if isinstance(own, OwnClass) and is_enumeration(own, "enum.IntEnum"):
        for value in (member_values(own) or {}).values() if not positions else ():
            yield from _values(value, scope, 0)
    match node:
        case ast.List(elts=items) | ast.Tuple(elts=items):
            for item in items:
                yield from _values(_part(item, positions), scope, depth)
        case ast.Call(func=function, args=[last]) if scope.called_name(function) == "range":
            count = integer_constant(last)
            yield from range(min(count or 0, _MOST)) if not positions else ()


def _part(node: ast.expr, positions: tuple[int, ...]) -> ast.expr:
    """Return the item of nested tuples at these positions, None if it is not known."""
    for position in positions:
        if not isinstance(node, ast.Tuple) or not 0 <= position < len(node.elts):
            return ast.Constant(None)
        node = node.elts[position]
    return node


def _is_tested(name: ast.Name, binding: Binding, scope: FunctionTypes) -> bool:
    """Return whether a function may do otherwise with some values of a name, or of its loop.

    What it does with an argument later does not matter, except in a loop.
    """
    names, is_argument = {name.id}, binding.how is How.ANNOTATION
    if binding.positions:
        for other, bindings in scope.bindings.names.items():
            names |= {other} if any(x.expression is binding.expression for x in bindings) else set()
    for node in nodes_of(scope.function) if scope.function is not None else ():
        match node:
            case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
                tests = [test]
            case ast.Assert(test=test) | ast.Match(subject=test):
                tests = [test]
            case ast.comprehension(ifs=tests) | ast.BoolOp(values=tests):
                pass
            case _:
                continue
        if is_argument and tests and tests[0].lineno > name.lineno:
            continue
        if names & {found for test in tests for found in _tested(test)}:
            return True
    return False


def _tested(node: ast.AST) -> Iterator[str]:
    """Yield the names in a condition, except in ``name is None``."""
    match node:
        case ast.Name(id=name):
            yield name
        case ast.Compare(ops=[ast.Is() | ast.IsNot()], comparators=[ast.Constant(value=None)]):
            pass
        case _:
            for child in children(node):
                yield from _tested(child)
