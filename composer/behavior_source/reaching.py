"""Which values of a name may reach a use of it, by the order of the statements of a function."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import lru_cache

from composer.behavior_source.method_body import Function
from composer.behavior_source.traversal import children, walk
from composer.fast_dataclass import dataclass

_DEFERRED = (ast.AsyncFunctionDef, ast.ClassDef, ast.FunctionDef, ast.Lambda)
_OWN_NAMES = (*_DEFERRED, ast.DictComp, ast.GeneratorExp, ast.ListComp, ast.SetComp)


@dataclass(frozen=True, slots=True)
class _Stored:
    """The statement of a function that binds a name, and the value.

    ``value`` is None for what is not a whole value.
    """

    at: int
    value: ast.expr | None


def reaching_values(node: ast.Name, function: Function) -> Sequence[ast.expr | None] | None:
    """Return the values that a name may have at a use, each None if it is not known.

    None: the use is not in the function itself, or the name is not bound there.
    """
    at = _uses(function).get(id(node))
    stored = _stored(function).get(node.id)
    if at is None or not stored:
        return None
    is_simple = not isinstance(function.body[at], _COMPOUND)
    before = [item for item in stored if item.at < at or (item.at == at and not is_simple)]
    first = max((item for item in _certain(function).get(node.id, ()) if item < at), default=None)
    if first is None:
        return None  # it may be an argument, or not be bound at all
    return [item.value for item in before if item.at >= first]


_COMPOUND = (
    *(ast.AsyncFor, ast.AsyncWith, ast.For, ast.If, ast.Match, ast.Try, ast.TryStar),
    *(ast.While, ast.With),
)


@lru_cache(maxsize=256)
def _uses(function: Function) -> dict[int, int]:
    """Return in which statement of a function each name is used, by its id."""
    return {
        id(node): at
        for at, statement in enumerate(function.body)
        for node in walk([statement], closed=_DEFERRED)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }


@lru_cache(maxsize=256)
def _stored(function: Function) -> dict[str, list[_Stored]]:
    """Return the places that bind each name."""
    found: dict[str, list[_Stored]] = {}
    for at, statement in enumerate(function.body):
        for name, value in _bound(statement):
            found.setdefault(name, []).append(_Stored(at, value))
    return found


@lru_cache(maxsize=256)
def _certain(function: Function) -> dict[str, list[int]]:
    """Return the statements that bind each name in any case."""
    found: dict[str, list[int]] = {}
    for at, statement in enumerate(function.body):
        for name in _names([statement]) or ():
            found.setdefault(name, []).append(at)
    return found


def _names(body: Sequence[ast.stmt]) -> set[str] | None:
    """Return the names that statements bind in any case, None if they leave the function."""
    found: set[str] = set()
    for statement in body:
        match statement:
            case ast.Assign() | ast.AnnAssign():
                found.update(name for name, _ in _bound(statement))
            case ast.If(body=first, orelse=[_, *_] as second):
                parts = [names for part in (first, second) if (names := _names(part)) is not None]
                if not parts:
                    return None
                found |= set.intersection(*parts)
            case ast.With(body=inner) | ast.AsyncWith(body=inner):
                found |= _names(inner) or set()
            case ast.Return() | ast.Raise() | ast.Continue() | ast.Break():
                return None
    return found


def _bound(statement: ast.stmt) -> Iterator[tuple[str, ast.expr | None]]:
    """Yield the names that a statement binds, with their values."""
    pending: list[ast.AST] = [statement]
    while pending:
        node = pending.pop()
        match node:
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    yield from _targets(target, value)
            case ast.AnnAssign(target=ast.Name(id=name), value=ast.expr() as value):
                yield name, value
            case ast.NamedExpr(target=ast.Name(id=name), value=value):
                yield name, value
            case ast.AugAssign():
                pass  # it changes an array in place
            case ast.Name(id=name, ctx=ast.Store() | ast.Del()):
                yield name, None
            case ast.ExceptHandler(name=str() as name) | ast.MatchAs(name=str() as name):
                yield name, None
        if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign | ast.NamedExpr):
            pending += [node.value] if node.value is not None else []
        elif not isinstance(node, _OWN_NAMES):
            pending += children(node)


def _targets(target: ast.expr, value: ast.expr) -> Iterator[tuple[str, ast.expr | None]]:
    match target:
        case ast.Name(id=name):
            yield name, value
        case ast.Tuple(elts=targets) | ast.List(elts=targets):
            given = value.elts if isinstance(value, ast.Tuple | ast.List) else []
            stars = [item for item in (*given, *targets) if isinstance(item, ast.Starred)]
            is_paired = len(given) == len(targets) and not stars
            for at, item in enumerate(targets):
                inner = item.value if isinstance(item, ast.Starred) else item
                if is_paired:
                    yield from _targets(inner, given[at])
                else:
                    yield from ((name, None) for name, _ in _targets(inner, value))
