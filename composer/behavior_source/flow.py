"""How a function ends: with a value, without one, or never.

What is known of a function is kept, because checks ask for it at each of its calls.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache

from composer.behavior_source.method_body import Function, dotted
from composer.behavior_source.traversal import children, walk

_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
_LEAVES = (ast.Return, ast.Raise, ast.Break, ast.Yield, ast.YieldFrom)
_WAITS = (ast.Await, ast.AsyncFor, ast.AsyncWith, ast.Yield, ast.YieldFrom)
#: Functions of the standard library that do not return.
_EXITS = frozenset({"exit", "quit", "_exit", "abort"})
#: Calls that wait, or would if they were awaited.
_WAITING_CALLS = frozenset({"sleep", "call", "send_goal", "result", "wait", "get", "join"})
#: Methods of collections and of ports that return.
_RETURNING = frozenset({"append", "appendleft", "clear", "extend", "insert", "publish"})
_ENDS_OR_WAITS = _EXITS | _WAITING_CALLS


@lru_cache(maxsize=512)
def empty_returns(function: Function) -> Sequence[ast.Return]:
    """Return the ``return`` statements of ``function`` that return None."""
    return tuple(
        node
        for node in _own_nodes(function.body)
        if isinstance(node, ast.Return)
        and (
            node.value is None
            or (isinstance(node.value, ast.Constant) and node.value.value is None)
        )
    )


def returned_values(function: Function) -> Iterator[ast.expr]:
    """Yield what the ``return`` statements of ``function`` return, except None."""
    empty = set(empty_returns(function))
    for node in _own_nodes(function.body):
        if isinstance(node, ast.Return) and node.value is not None and node not in empty:
            yield node.value


@lru_cache(maxsize=512)
def yields(function: Function) -> Sequence[ast.Yield | ast.YieldFrom]:
    """Return the ``yield`` expressions of ``function`` itself, which make it a generator."""
    nodes = _own_nodes(function.body)
    return tuple(node for node in nodes if isinstance(node, ast.Yield | ast.YieldFrom))


@lru_cache(maxsize=512)
def reaches_end(function: Function) -> bool:
    """Return whether ``function`` may reach the end of its body, and so return None.

    A generator is never said to. What calls do is not known: a method that always raises counts as
    one that returns.
    """
    if any(yields(function)):
        return False
    return _continues(function.body)


def may_raise_at_end(
    function: Function, returns: Callable[[ast.Call], bool] = lambda _: False
) -> bool:
    """Return whether ``function`` may never reach its end: a loop, a call or a match is there.

    ``returns`` says which other calls are known to return.
    """
    pending = [function.body[-1]]
    while pending:
        match pending.pop():
            case ast.For(body=body) | ast.AsyncFor(body=body) | ast.While(body=body):
                if any(isinstance(node, ast.Return) for node in _own_nodes(body)):
                    return True
            case ast.Expr(value=ast.Call() as call):
                is_known = dotted(call.func).startswith("self.log.") or _called(call) in _RETURNING
                if not is_known and not returns(call):
                    return True
            case ast.If(body=body, orelse=orelse):
                pending += [body[-1], *orelse[-1:]]
            case ast.With(body=body) | ast.AsyncWith(body=body):
                pending.append(body[-1])
            case ast.Try(body=body, handlers=handlers, orelse=orelse, finalbody=finalbody):
                pending += [body[-1], *orelse[-1:], *finalbody[-1:]]
                pending += [handler.body[-1] for handler in handlers]
            case ast.Match(cases=cases):
                if any(isinstance(case.pattern, ast.MatchClass) for case in cases):
                    return True  # the cases may be all classes that there are
                pending += [case.body[-1] for case in cases]
    return False


def returns_nothing(function: Function) -> bool:
    """Return whether ``function`` returns None on every path, and does not wait to be overridden.

    A method that always raises, and one with a decorator, is not said to.
    """
    if function.decorator_list or is_stub(function):
        return False
    return reaches_end(function) and next(returned_values(function), None) is None


def is_stub(function: Function) -> bool:
    """Return whether a function only has a docstring, 'pass' or '...': one to be overridden."""
    return all(
        isinstance(item, ast.Pass)
        or (isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant))
        for item in function.body
    )


def always_executed(
    function: Function, is_false: Callable[[ast.expr], bool] = lambda _: False
) -> frozenset[int]:
    """Return the lines that each call of a function executes, if no statement raises.

    ``is_false`` says which conditions to regard as false.
    """
    found: set[int] = set()
    for statement, head in _certain_heads(function.body, is_false):
        found.update(_lines(statement.lineno, head))
        for node in walk([head]):
            if isinstance(node, ast.IfExp | ast.BoolOp | ast.Lambda | ast.ListComp):
                found.difference_update(_lines(node.lineno, node))
    return frozenset(found)


def always_evaluated(function: Function) -> Iterator[ast.AST]:
    """Yield the nodes that each call of a function evaluates, if no statement raises."""
    for _, head in _certain_heads(function.body, lambda _: False):
        yield from evaluated(head)


def evaluated(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes that are evaluated with a statement or an expression, whatever they give."""
    pending = [node]
    while pending:
        node = pending.pop()
        yield node
        match node:
            case ast.BoolOp(values=[first, *_]) | ast.IfExp(test=first):
                pending.append(first)
            case ast.Compare(left=left, comparators=[first, *_]):
                pending += (left, first)
            case ast.Assert(test=test):
                pending.append(test)
            case ast.Lambda() | ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                pass
            case (
                ast.ListComp(generators=[first, *_])
                | ast.SetComp(generators=[first, *_])
                | ast.DictComp(generators=[first, *_])
                | ast.GeneratorExp(generators=[first, *_])
            ):
                pending.append(first.iter)
            case _:
                pending += children(node)


def _certain_heads(
    body: Sequence[ast.stmt], is_false: Callable[[ast.expr], bool]
) -> Iterator[tuple[ast.stmt, ast.AST]]:
    """Yield the statements that are always executed, each with the part that is."""
    pending: list[ast.stmt] = [*body][::-1]
    while pending:
        statement = pending.pop()
        head: ast.AST = statement
        match statement:
            case ast.For(body=inner, iter=iterated):
                head = iterated
                if any(isinstance(node, ast.If | ast.Break | ast.Return) for node in walk(inner)):
                    return
                pending += inner[::-1]
            case ast.With(body=inner, items=[ast.withitem(context_expr=context), *_]):
                head = context
                pending += inner[::-1]
            case ast.If(test=test, orelse=[]) if is_false(test):
                head = test
            case ast.If() | ast.Try() | ast.Match() | ast.While() | ast.FunctionDef():
                return
        yield statement, head


def _lines(first: int, node: ast.AST) -> range:
    return range(first, (getattr(node, "end_lineno", None) or first) + 1)


def endless_loops(function: Function) -> Iterator[ast.While]:
    """Yield the loops that never let anything else run: they neither end nor wait.

    A loop that waits for a request to cancel is one of them if it does not wait for anything else:
    the request cannot be handled meanwhile.
    """
    for node in _own_nodes(function.body):
        if isinstance(node, ast.While) and _never_ends(node):
            yield node


def _never_ends(loop: ast.While) -> bool:
    inside = [loop.test, *_own_nodes(loop.body)]
    if any(isinstance(node, _WAITS) for node in (*inside, *ast.walk(loop.test))):
        return False
    if any(isinstance(node, _LEAVES) or _called(node) in _ENDS_OR_WAITS for node in inside):
        return False
    return _is_true(loop.test) or _waits_for_cancel(loop.test) or _is_empty(loop.body)


def _waits_for_cancel(test: ast.expr) -> bool:
    return any(
        isinstance(node, ast.Attribute) and node.attr == "is_cancel_requested"
        for node in ast.walk(test)
    )


def _is_empty(body: Sequence[ast.stmt]) -> bool:
    """Return whether a body does nothing, so that only other code can end its loop."""
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
            found = True
        case ast.If(body=body, orelse=orelse):
            found = not _continues(body) and bool(orelse) and not _continues(orelse)
        case ast.While(test=test, body=body, orelse=orelse):
            is_endless = _is_true(test) or not _continues(orelse)
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
            found = _called(statement.value) in _EXITS
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


def _called(node: ast.AST) -> str:
    """Return the last part of the name of the function that ``node`` calls, or ""."""
    if not isinstance(node, ast.Call):
        return ""
    return str(getattr(node.func, "attr", getattr(node.func, "id", "")))


def _is_true(test: ast.expr) -> bool:
    return isinstance(test, ast.Constant) and bool(test.value)


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


def _own_nodes(body: Sequence[ast.stmt]) -> Iterator[ast.AST]:
    """Yield the nodes of ``body`` in source order, without nested functions and classes."""
    return walk(body, closed=_SCOPES)
