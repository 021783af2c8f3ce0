"""To which ports a method publishes: on every call, and at all."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

Function = ast.FunctionDef | ast.AsyncFunctionDef

#: What may end a method before its last statement.
_WAYS_OUT = (ast.Return, ast.Raise, ast.Yield, ast.YieldFrom, ast.Assert)


@dataclass(frozen=True, slots=True)
class Publishing:
    """Names of publishers, as in ``self.publishers.<name>.publish(...)``.

    ``always`` are those that each call publishes to once, if nothing in it fails; ``somewhere``
    are all that the method names.
    """

    always: tuple[str, ...] = ()
    somewhere: tuple[str, ...] = ()


def publishing_of(function: Function) -> Publishing:
    """Return to what a method publishes, as far as its text tells."""
    return Publishing(
        always=_once_each(_straight_on(function)),
        somewhere=tuple(dict.fromkeys(_named(function))),
    )


def _straight_on(function: Function) -> Iterator[str]:
    """Yield what statements of the method itself publish to, up to where it may end early."""
    for statement in function.body:
        if isinstance(statement, ast.Expr):
            name = _published(statement.value)
            if name is not None:
                yield name
        elif any(isinstance(inner, _WAYS_OUT) for inner in ast.walk(statement)):
            return


def _once_each(names: Iterator[str]) -> tuple[str, ...]:
    found = list(names)
    return tuple(name for name in dict.fromkeys(found) if found.count(name) == 1)


def _published(expression: ast.expr) -> str | None:
    """Return ``x`` for ``self.publishers.x.publish(...)``."""
    match expression:
        case ast.Call(func=ast.Attribute(attr="publish", value=publisher)):
            return _publisher(publisher)
        case _:
            return None


def _named(function: Function) -> Iterator[str]:
    for inner in ast.walk(function):
        name = _publisher(inner)
        if name is not None:
            yield name


def _publisher(node: ast.AST) -> str | None:
    match node:
        case ast.Attribute(
            attr=name,
            value=ast.Attribute(attr="publishers", value=ast.Name(id="self")),
        ):
            return name
        case _:
            return None
