"""To which ports a method publishes: on every call, and at all."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from composer.behavior_source.bodies import Body, Function

#: What may end a method before its last statement.
_WAYS_OUT = (ast.Return, ast.Raise, ast.Yield, ast.YieldFrom, ast.Assert)
_PUBLISHER = re.compile(r"self\.publishers\.(?P<port>\w+)(?P<rest>(\..+)?)")
_PUBLISH = ".publish"


@dataclass(frozen=True, slots=True)
class Publishing:
    """Names of publishers, as in ``self.publishers.<name>.publish(...)``.

    ``always`` are those that each call publishes to once, if nothing in it fails; ``somewhere``
    are all that the method names. ``handed_on`` are those that it gives away or keeps: who gets
    hold of one may publish whenever he likes.
    """

    always: tuple[str, ...] = ()
    somewhere: tuple[str, ...] = ()
    handed_on: tuple[str, ...] = ()


def publishing_of(function: Function, body: Body) -> Publishing:
    """Return to what a method publishes, as far as its text tells."""
    named = [*body.names.values(), *(call.name for call in body.calls), *body.mentioned]
    somewhere = tuple(dict.fromkeys(port for port, _ in _publishers(named)))
    if not somewhere:
        return Publishing()
    return Publishing(
        always=_once_each(_straight_on(function, body)),
        somewhere=somewhere,
        handed_on=tuple(
            dict.fromkeys(
                port for port, rest in _publishers(body.mentioned) if rest in {"", _PUBLISH}
            )
        ),
    )


def published_port(name: str) -> str | None:
    """Return ``x`` for ``self.publishers.x.publish``."""
    return next((port for port, rest in _publishers([name]) if rest == _PUBLISH), None)


def _publishers(names: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield the ports that names begin with, and what follows in the name."""
    for name in names:
        match = _PUBLISHER.fullmatch(name)
        if match is not None:
            yield match["port"], match["rest"]


def _straight_on(function: Function, body: Body) -> Iterator[str]:
    """Yield what statements of the method itself publish to, up to where it may end early."""
    for statement in function.body:
        if isinstance(statement, ast.Expr):
            name = _published(statement.value, body)
            if name is not None:
                yield name
        elif any(isinstance(inner, _WAYS_OUT) for inner in ast.walk(statement)):
            return


def _once_each(names: Iterator[str]) -> tuple[str, ...]:
    found = list(names)
    return tuple(name for name in dict.fromkeys(found) if found.count(name) == 1)


def _published(expression: ast.expr, body: Body) -> str | None:
    if isinstance(expression, ast.Call):
        return published_port(body.full_name(expression.func))
    return None
