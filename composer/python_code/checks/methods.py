"""Methods without ``self``, and functions that are called, or not called, by mistake."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.python_code.checks.scopes import Code, NodeScope
from composer.python_code.problems import Family, Problem
from composer.python_code.syntax import Method
from composer.python_code.trees import (
    Function,
    dotted,
    positional_arguments,
    walk,
)

#: Methods of goals, ports and timers that have no meaning as plain attributes.
_METHODS = frozenset(
    {"abort", "cancel", "canceled", "destroy", "publish", "publish_feedback", "reset", "succeed"}
)
_CLASS_METHODS = frozenset({"__new__", "__init_subclass__", "__class_getitem__"})


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


def missing_self(code: Code) -> Iterator[Problem]:
    """Yield the methods that lack their first argument."""
    is_behavior = code.node.behavior is not None
    for module in code.source.own_modules:
        lacking = [
            (class_, method, positional_arguments(method.node))
            for class_ in module.classes.values()
            for method in class_.methods
            if method.node is not None and _lacks_self(method.node)
        ]
        nodes = walk(module.tree.body if lacking else [])
        named = {dotted(node) for node in nodes if isinstance(node, ast.Name | ast.Attribute)}
        for class_, method, arguments in lacking:
            # What the class or its body uses is a plain function.
            if not named & {method.name, f"{class_.name}.{method.name}"}:
                names = (item.arg for item in arguments)
                hint = f"write 'def {method.name}({', '.join(('self', *names))})'"
                message = f"method '{method.name}' of '{class_.name}' lacks 'self'"
                yield Problem(Family.SELF, message, method.span, hint, is_behavior)


def _lacks_self(function: Function) -> bool:
    """Return whether a method has no argument at all, or uses ``self`` without having it."""
    if function.decorator_list or function.name in _CLASS_METHODS:
        return False
    arguments = [*positional_arguments(function), *function.args.kwonlyargs]
    if not arguments:
        return function.args.vararg is None
    names = (node for node in ast.walk(function) if isinstance(node, ast.Name))
    uses = {type(node.ctx) for node in names if node.id == "self"}
    return uses == {ast.Load} and all(item.arg != "self" for item in arguments)


def _method(node: ast.expr | None, scope: NodeScope) -> Method | None:
    """Return the method of the class that an expression is, None if it is not known."""
    match node:
        case ast.Attribute(value=ast.Name(id="self"), attr=name) if scope.method is not None:
            method = scope.code.source.method(name)
            is_known = method is not None and method.known and name not in scope.code.assigned
            return method if is_known else None
    return None
