"""Asynchronous calls that are not awaited."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.fitting import kind_of
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.bindings import How, nodes_of
from composer.behavior_types.values import ApiMethod, Collection, InterfaceClass, Pending


def used_without_await(function: Function, scope: FunctionTypes) -> Iterator[Pending]:
    """Yield the calls whose name is only used as a value: in texts, sums and messages.

    A name that is passed to other code, returned or stored may be awaited there.
    """
    stored: dict[str, list[Pending]] = {}
    for name, bindings in scope.bindings.names.items():
        for binding in bindings:
            is_whole = binding.how is How.VALUE and not binding.positions
            if is_whole and isinstance(binding.expression, ast.Call):
                found = scope.type_of(binding.expression)
                if isinstance(found, Pending):
                    stored.setdefault(name, []).append(found)
    if not stored:
        return
    uses = _uses(function, stored)
    for name, calls in stored.items():
        if uses[name] and all(_is_value(parent, scope) for parent in uses[name]):
            yield from calls


def _uses(function: Function, names: dict[str, list[Pending]]) -> dict[str, list[ast.AST]]:
    """Return the syntax around each use of the names."""
    uses: dict[str, list[ast.AST]] = {name: [] for name in names}
    for node in nodes_of(function):
        if isinstance(node, ast.keyword):  # its call is around it
            continue
        for child in ast.iter_child_nodes(node):
            inner = child.value if isinstance(child, ast.keyword) else child
            if isinstance(inner, ast.Name) and isinstance(inner.ctx, ast.Load):
                uses.get(inner.id, []).append(node)
    return uses


def _is_value(parent: ast.AST, scope: FunctionTypes) -> bool:
    match parent:
        case ast.Assign(targets=[ast.Subscript(value=owner)]):  # in a dict of something else
            stored = scope.type_of(owner)
            return isinstance(stored, Collection) and kind_of(stored.element) is not None
        case ast.FormattedValue() | ast.BinOp() | ast.If() | ast.IfExp() | ast.UnaryOp():
            return True
        case ast.Call(func=function):
            return isinstance(scope.type_of(function), InterfaceClass | ApiMethod)
        case _:
            return False


def unawaited(node: ast.AST, function: Function, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the awaitables that a statement or an operation uses as values."""
    match node:
        case ast.Expr(value=value):
            yield from pending_value(value, function, scope)
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            yield from _pending_call(test, function, scope)
        case ast.UnaryOp(operand=operand):
            yield from _pending_call(operand, function, scope)
        case ast.BoolOp(values=values):
            for value in values:
                yield from _pending_call(value, function, scope)
        case ast.BinOp(left=left, right=right):
            yield from pending_value(left, function, scope)
            yield from pending_value(right, function, scope)
        case ast.AugAssign(value=value):
            yield from pending_value(value, function, scope)
        case ast.Compare(left=left, comparators=others):
            for value in (left, *others):
                yield from _pending_call(value, function, scope)
        case ast.Subscript(value=value) | ast.FormattedValue(value=value):
            yield from pending_value(value, function, scope)
        case ast.For(iter=iterated):
            yield from pending_value(iterated, function, scope)
        case ast.Return(value=ast.Call() as value):
            if isinstance(function, ast.AsyncFunctionDef):
                yield from pending_value(value, function, scope)
        case _:
            pass


def pending_value(
    node: ast.expr, function: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield the problem of an awaitable in the place of a value."""
    found = scope.type_of(node)
    if isinstance(found, Pending):
        yield missing_await(found, function, scope)


def _pending_call(
    node: ast.expr, function: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Check a call; a name in this place may well be an awaitable that was stored."""
    if isinstance(node, ast.Call):
        yield from pending_value(node, function, scope)


def missing_await(pending: Pending, function: Function, scope: FunctionTypes) -> CodeProblem:
    """Return the problem of an asynchronous call that is not awaited."""
    is_async = isinstance(function, ast.AsyncFunctionDef)
    hint = "write 'await' before it"
    if not is_async:
        hint += f", and 'async def {function.name}'"
    message = f"'{pending.name}' is asynchronous and is not awaited"
    return CodeProblem(Kind.AWAIT, message, span_of(pending.call.func, scope.home.source), hint)
