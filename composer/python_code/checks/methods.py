"""Methods that lack ``self`` or a ``return``, and statements without effect."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.python_code.checks.scopes import Code, Scope
from composer.python_code.nodes.behaviors import GENERAL_HANDLERS, handlers
from composer.python_code.problems import Family, Problem
from composer.python_code.source.flow import empty_returns, reaches_end
from composer.python_code.source.method_body import dotted
from composer.python_code.source.receivers import lacks_self
from composer.python_code.source.spans import span_of
from composer.python_code.source.traversal import walk

#: Methods of goals and ports whose names mean nothing else.
_METHODS = frozenset({"abort", "canceled", "publish", "publish_feedback", "succeed"})


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


def missing_returns(code: Code) -> Iterator[Problem]:
    """Yield the handlers that must return a response or a decision, and may not."""
    for handler in handlers(code.node):
        method = code.source.method(handler.name)
        is_service = handler.kind == "service"
        is_needed = is_service or handler.name.startswith("accept_")
        if not is_needed or method is None or method.node is None or not method.known:
            continue
        what, example = ("the response", "response") if is_service else ("True or False", "True")
        message = f"'{handler.name}' must return {what}"
        for statement in empty_returns(method.node):
            span = span_of(statement, method.span.file)
            hint = f"write 'return {example}'"
            yield Problem(Family.RETURN, f"{message}, not None", span, hint)
        if reaches_end(method.node):
            message += ", but may end without a 'return'"
            yield Problem(Family.RETURN, message, method.span, f"end it with 'return {example}'")


def missing_self(code: Code) -> Iterator[Problem]:
    """Yield the methods that lack their first argument."""
    expected = {name: len(arguments) for name, arguments in GENERAL_HANDLERS.items()}
    expected |= {item.name: len(item.arguments) for item in handlers(code.node)}
    is_behavior = code.node.behavior is not None
    own = {id(class_) for _, class_ in code.source.own_classes} if is_behavior else set()
    for module in code.source.own_modules:
        lacking = [
            (class_, method, method.node.args)
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
                names = (item.arg for item in (*arguments.posonlyargs, *arguments.args))
                hint = f"write 'def {method.name}({', '.join(('self', *names))})'"
                message = f"method '{method.name}' of '{class_.name}' lacks 'self'"
                yield Problem(Family.SELF, message, method.span, hint, is_behavior)
