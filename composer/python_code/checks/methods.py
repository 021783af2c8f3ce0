"""Methods without ``self`` or a result, and functions that are called, or not called, by mistake.

The type checker reports callbacks that take other arguments.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.python_code.checks.scopes import Code, Scope
from composer.python_code.nodes.behaviors import GENERAL_HANDLERS, handlers
from composer.python_code.problems import Family, Problem
from composer.python_code.source import Method
from composer.python_code.source.flow import lacks_self, reaches_end, returns_nothing
from composer.python_code.source.trees import (
    argument,
    called_name,
    dotted,
    positional_arguments,
    walk,
)

#: Methods of goals, ports and timers that have no meaning as plain attributes.
_METHODS = frozenset(
    {"abort", "cancel", "canceled", "destroy", "publish", "publish_feedback", "reset", "succeed"}
)
_TAKING_CALLBACKS = frozenset(
    {"ActionServer", "add_done_callback", "add_on_set_parameters_callback"}
    | {"create_guard_condition", "create_service", "create_subscription", "create_timer"}
    | {"send_goal", "send_goal_async"}
)
#: Where callbacks that return something are passed: their position, name and result.
_RETURNING = {
    "create_service": (2, "callback", "response"),
    "ActionServer": (3, "execute_callback", "result"),
}


def unused_values(scope: Scope) -> Iterator[Problem]:
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


def unawaited_values(scope: Scope) -> Iterator[Problem]:
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
    expected = {name: len(arguments) for name, arguments in GENERAL_HANDLERS.items()}
    expected |= {item.name: len(item.arguments) for item in handlers(code.node)}
    is_behavior = code.node.behavior is not None
    own = {id(class_) for _, class_ in code.source.own_classes} if is_behavior else set()
    for module in code.source.own_modules:
        lacking = [
            (class_, method, positional_arguments(method.node))
            for class_ in module.classes.values()
            for method in class_.methods
            if method.node is not None
            and lacks_self(method.node, expected.get(method.name) if id(class_) in own else None)
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


def callback_problems(scope: Scope) -> Iterator[Problem]:
    """Yield the callbacks that are called at once, or that return nothing."""
    for call in scope.nodes:
        name = called_name(call)
        if not isinstance(call, ast.Call) or name not in _TAKING_CALLBACKS:
            continue
        for item in (*call.args, *(keyword.value for keyword in call.keywords)):
            method = _method(item.func, scope) if isinstance(item, ast.Call) else None
            if method is not None and (method.is_async or _returns_nothing(method)):
                message = "the function is called here, not passed"
                hint = f"write self.{method.name} without '()'"
                yield scope.problem(Family.SIGNATURE, message, item, hint)
        if name in _RETURNING:
            position, role, result = _RETURNING[name]
            method = _method(argument(call, position, role), scope)
            if method is not None and _returns_nothing(method):
                yield _no_result(method, result)


def handler_problems(code: Code) -> Iterator[Problem]:
    """Yield the handlers of a behavior that may end without a response or a decision.

    The type checker reports a plain 'return'.
    """
    for handler in handlers(code.node):
        method = code.source.method(handler.name)
        is_service = handler.kind == "service"
        is_needed = is_service or handler.name.startswith("accept_")
        if not is_needed or method is None or method.node is None or not method.known:
            continue
        if reaches_end(method.node):
            yield _no_result(method, "response" if is_service else "decision")


def _no_result(method: Method, result: str) -> Problem:
    message = f"'{method.name}' must return the {result}, but may end without a 'return'"
    value = "True" if result == "decision" else result
    return Problem(Family.RETURN, message, method.span, f"end it with 'return {value}'")


def _returns_nothing(method: Method) -> bool:
    return method.node is not None and returns_nothing(method.node)


def _method(node: ast.expr | None, scope: Scope) -> Method | None:
    """Return the method of the class that an expression is, None if it is not known."""
    match node:
        case ast.Attribute(value=ast.Name(id="self"), attr=name) if scope.method is not None:
            method = scope.code.source.method(name)
            is_known = method is not None and method.known and name not in scope.code.assigned
            return method if is_known else None
    return None
