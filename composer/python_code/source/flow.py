"""How a function ends: with a value, or without one."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from composer.python_code.source.method_body import Function
from composer.python_code.source.traversal import children, walk

_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
#: Functions of the standard library that do not return.
EXITS = frozenset({"exit", "quit", "_exit", "abort"})


def empty_returns(function: Function) -> Iterator[ast.Return]:
    """Yield the ``return`` statements of ``function`` that return None."""
    for node in own_nodes(function.body):
        if isinstance(node, ast.Return):
            value = node.value
            if value is None or (isinstance(value, ast.Constant) and value.value is None):
                yield node


def returned_values(function: Function) -> Iterator[ast.expr]:
    """Yield what the ``return`` statements of ``function`` return, except None."""
    empty = set(empty_returns(function))
    for node in own_nodes(function.body):
        if isinstance(node, ast.Return) and node.value is not None and node not in empty:
            yield node.value


def reaches_end(function: Function) -> bool:
    """Return whether ``function`` may reach the end of its body, and so return None.

    A generator is never said to. What calls do is not known: a method that always raises counts as
    one that returns.
    """
    nodes = own_nodes(function.body)
    if any(isinstance(node, ast.Yield | ast.YieldFrom) for node in nodes):
        return False
    return _continues(function.body)


def returns_nothing(function: Function) -> bool:
    """Return whether ``function`` returns None on every path, and does not wait to be overridden.

    A method that always raises, and one with a decorator, is not said to.
    """
    if function.decorator_list or _is_stub(function) or not reaches_end(function):
        return False
    return next(returned_values(function), None) is None


def own_nodes(body: Sequence[ast.stmt]) -> Iterator[ast.AST]:
    """Yield the nodes of ``body`` in source order, without nested functions and classes."""
    return walk(body, closed=_SCOPES)


def called_name(node: ast.AST) -> str:
    """Return the last part of the name of the function that ``node`` calls, or ""."""
    if not isinstance(node, ast.Call):
        return ""
    return str(getattr(node.func, "attr", getattr(node.func, "id", "")))


def is_true(test: ast.expr) -> bool:
    """Return whether a condition is a constant that is true."""
    return isinstance(test, ast.Constant) and bool(test.value)


def _is_stub(function: Function) -> bool:
    """Return whether a function only has a docstring, 'pass' or '...': one to be overridden."""
    return all(
        isinstance(item, ast.Pass)
        or (isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant))
        for item in function.body
    )


def _continues(body: Sequence[ast.stmt]) -> bool:
    """Return whether the statement after ``body`` may be reached."""
    return not any(_leaves(statement) for statement in body)


def _leaves(statement: ast.stmt) -> bool:
    """Return whether the statement after ``statement`` is never reached."""
    match statement:
        case ast.Return() | ast.Raise() | ast.Continue() | ast.Break():
            found = True
        case ast.If(body=body, orelse=orelse):
            found = not _continues(body) and bool(orelse) and not _continues(orelse)
        case ast.While(test=test, body=body, orelse=orelse):
            is_endless = is_true(test) or not _continues(orelse)
            found = is_endless and not _has_break(body)
        case ast.For(body=body, orelse=orelse) | ast.AsyncFor(body=body, orelse=orelse):
            found = not _continues(orelse) and not _has_break(body)
        case ast.With(body=body) | ast.AsyncWith(body=body):
            found = not _continues(body)
        case ast.Match(cases=cases):
            found = _is_exhaustive(cases) and not any(_continues(case.body) for case in cases)
        case ast.Try() | ast.TryStar():
            found = _try_leaves(statement)
        case ast.Expr():
            found = called_name(statement.value) in EXITS
        case ast.Assert(test=ast.Constant(value=False)):
            found = True
        case _:
            found = False
    return found


def _try_leaves(statement: ast.Try | ast.TryStar) -> bool:
    if not _continues(statement.finalbody):
        return True
    body = [*statement.body, *statement.orelse]
    handlers = (handler.body for handler in statement.handlers)
    return not _continues(body) and not any(_continues(handler) for handler in handlers)


def _is_exhaustive(cases: Sequence[ast.match_case]) -> bool:
    last = cases[-1]
    is_wildcard = isinstance(last.pattern, ast.MatchAs) and last.pattern.pattern is None
    return is_wildcard and last.guard is None


def _has_break(body: Sequence[ast.stmt]) -> bool:
    """Return whether a ``break`` in ``body`` leaves the loop that it is the body of."""
    pending: list[ast.AST] = list(body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Break):
            return True
        if isinstance(node, ast.For | ast.AsyncFor | ast.While):
            pending.extend(node.orelse)
        elif not isinstance(node, _SCOPES):
            pending.extend(children(node))
    return False
