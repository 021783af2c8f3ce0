"""Whether a function has ``self``, and how it ends: with a value, or without one."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from composer.python_code.source.trees import (
    SCOPES,
    Function,
    called_name,
    is_none,
    positional_arguments,
    walk,
)

#: Functions of the standard library that do not return.
EXITS = frozenset({"exit", "quit", "_exit", "abort"})
_LOOPS = (ast.For, ast.AsyncFor, ast.While)
_CLASS_METHODS = frozenset({"__new__", "__init_subclass__", "__class_getitem__"})
_RECEIVERS = frozenset({"self", "cls", "mcs"})


def lacks_self(function: Function, arguments: int | None = None) -> bool:
    """Return whether a method lacks its first argument, ``self``.

    It does if it has no argument at all, if it uses ``self`` without having it, or if it takes
    exactly the ``arguments`` that a handler gets besides ``self``.
    """
    if function.decorator_list or function.name in _CLASS_METHODS:
        return False
    positional = [item.arg for item in positional_arguments(function)]
    if not positional:
        return function.args.vararg is None
    if positional[0] in _RECEIVERS or positional[0].startswith("_"):
        return False
    names = [node for node in ast.walk(function) if isinstance(node, ast.Name)]
    contexts = [node.ctx for node in names if node.id == "self"]
    uses_self = bool(contexts) and all(isinstance(item, ast.Load) for item in contexts)
    every = [*positional, *(item.arg for item in function.args.kwonlyargs)]
    return ("self" not in every and uses_self) or len(positional) == arguments


def returned_values(function: Function) -> Iterator[ast.expr]:
    """Yield what the ``return`` statements of ``function`` return, except None."""
    for node in walk(function.body, closed=SCOPES):
        if isinstance(node, ast.Return) and node.value is not None and not is_none(node.value):
            yield node.value


def reaches_end(function: Function) -> bool:
    """Return whether ``function`` may reach the end of its body, and so return None.

    A generator is never said to. What calls do is not known: a method that always raises counts as
    one that returns.
    """
    nodes = walk(function.body, closed=SCOPES)
    if any(isinstance(node, ast.Yield | ast.YieldFrom) for node in nodes):
        return False
    return _continues(function.body)


def returns_nothing(function: Function) -> bool:
    """Return whether ``function`` returns None on every path, and does not wait to be overridden.

    A method that always raises, and one with a decorator, is not said to.
    """
    if function.decorator_list or is_empty(function.body) or not reaches_end(function):
        return False
    return next(returned_values(function), None) is None


def is_true(test: ast.expr) -> bool:
    """Return whether a condition is a constant that is true."""
    return isinstance(test, ast.Constant) and bool(test.value)


def is_empty(body: Sequence[ast.stmt]) -> bool:
    """Return whether a body only has a docstring, 'pass' or '...'."""
    return all(
        isinstance(item, ast.Pass)
        or (isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant))
        for item in body
    )


def _continues(body: Sequence[ast.stmt]) -> bool:
    """Return whether the statement after ``body`` may be reached."""
    return not any(_leaves(statement) for statement in body)


def _leaves(statement: ast.stmt) -> bool:
    """Return whether the statement after ``statement`` is never reached."""
    match statement:
        case ast.Return() | ast.Raise() | ast.Continue() | ast.Break():
            return True
        case ast.If(body=body, orelse=orelse):
            branches = [body]
            while len(orelse) == 1 and isinstance(orelse[0], ast.If):  # there may be many 'elif'
                branches.append(orelse[0].body)
                orelse = orelse[0].orelse
            return not any(map(_continues, (*branches, orelse)))
        case ast.While(test=test, body=body):
            return is_true(test) and not _has_break(body)
        case ast.With(body=body) | ast.AsyncWith(body=body):
            return not _continues(body)
        case ast.Match(cases=cases):
            last = cases[-1]  # it takes every value, unless it has a pattern or a guard
            is_any = isinstance(last.pattern, ast.MatchAs) and last.pattern.pattern is None
            is_any = is_any and last.guard is None
            return is_any and not any(_continues(case.body) for case in cases)
        case ast.Try() | ast.TryStar():
            paths = [[*statement.body, *statement.orelse]]
            paths += [handler.body for handler in statement.handlers]
            return not _continues(statement.finalbody) or not any(map(_continues, paths))
        case ast.Expr(value=value):
            return called_name(value) in EXITS
        case ast.Assert(test=ast.Constant(value=False)):
            return True
    return False


def _has_break(body: Sequence[ast.stmt]) -> bool:
    """Return whether a ``break`` in ``body`` leaves the loop that it is the body of."""
    return any(
        isinstance(node, ast.Break) or (isinstance(node, _LOOPS) and _has_break(node.orelse))
        for node in walk(body, closed=(*SCOPES, *_LOOPS))
    )
