"""Methods without ``self``, and functions that are called, or not called, by mistake."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.python_code.checks.scopes import NodeScope
from composer.python_code.problems import Family, Problem
from composer.python_code.syntax import Method
from composer.python_code.trees import (
    dotted,
)

#: Methods of goals, ports and timers that have no meaning as plain attributes.
_METHODS = frozenset(
    {"abort", "cancel", "canceled", "destroy", "publish", "publish_feedback", "reset", "succeed"}
)


def unused_values(scope: NodeScope) -> Iterator[Problem]:
    """Yield the comparisons that are not used, and the functions that are not called."""
    for node in scope.nodes:
        match node:
            case ast.Expr(value=ast.Compare(ops=[ast.Eq(), *_]) as value):
                message = "the result of this comparison is not used"
                yield scope.problem(Family.UNUSED, message, value, "assign with '='")
            case ast.Expr(value=ast.Attribute(attr=name) as value):
                method = scope.code.source.method(name) if scope.method is not None else None
                is_own = dotted(value) == f"self.{name}" and method is not None and method.known
                if is_own or name in _METHODS:
                    message = f"'{name}' is not called"
                    yield scope.problem(Family.UNUSED, message, value, "add '()'")


def unawaited_values(scope: NodeScope) -> Iterator[Problem]:
    """Yield the coroutines of the class that are assigned, and then used as if they were values.

    The type checker reports those whose attributes are used, and those that are not used.
    """
    for node in scope.nodes:
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call(func=function)):
                method = _method(function, scope)
                uses = [item for item in scope.nodes if isinstance(item, ast.FormattedValue)]
                is_shown = any(dotted(item.value) == name for item in uses)
                if method is not None and method.is_async and is_shown:
                    message = f"'{dotted(function)}' is asynchronous and is not awaited"
                    hint = f"write 'await {dotted(function)}(...)'"
                    yield scope.problem(Family.AWAIT, message, function, hint)


def _method(node: ast.expr | None, scope: NodeScope) -> Method | None:
    """Return the method of the class that an expression is, None if it is not known."""
    match node:
        case ast.Attribute(value=ast.Name(id="self"), attr=name) if scope.method is not None:
            method = scope.code.source.method(name)
            is_known = method is not None and method.known and name not in scope.code.assigned
            return method if is_known else None
    return None
