"""Asynchronous calls that are stored in a name and used as if they had been awaited."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_source import Function
from composer.behavior_types.bindings import How, nodes_of
from composer.behavior_types.expressions import FunctionTypes
from composer.behavior_types.values import ApiMethod, InterfaceClass, Pending


def used_without_await(function: Function, scope: FunctionTypes) -> Iterator[Pending]:
    """Yield the calls whose name is only used as a value: in texts, sums and messages.

    A name that is passed to other code, returned or stored may be awaited there.
    """
    stored: dict[str, list[Pending]] = {}
    for name, bindings in scope.bindings.names.items():
        for binding in bindings:
            if binding.how is How.VALUE and isinstance(binding.expression, ast.Call):
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
        case ast.FormattedValue() | ast.BinOp() | ast.If() | ast.IfExp() | ast.UnaryOp():
            return True
        case ast.Call(func=function):
            return isinstance(scope.type_of(function), InterfaceClass | ApiMethod)
        case _:
            return False
