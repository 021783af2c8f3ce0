"""The ports that a method publishes to, on every call or at all."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator

from composer.fast_dataclass import dataclass
from composer.python_code.source.method_body import Body, Function

#: Statements that may leave a method early.
_EXITS = (ast.Return, ast.Raise, ast.Yield, ast.YieldFrom, ast.Assert)
_PUBLISHER = re.compile(r"self\.publishers\.(?P<port>\w+)(?P<rest>(\..+)?)")
_PUBLISH = ".publish"


@dataclass(frozen=True, slots=True)
class PublisherUses:
    """Names of publishers, as in ``self.publishers.<name>.publish(...)``.

    ``always`` are those that each call publishes to exactly once unless it fails; ``anywhere`` are
    all that the method names. ``passed_on`` are those that it passes on or stores: they may publish
    at any time.
    """

    always: tuple[str, ...] = ()
    anywhere: tuple[str, ...] = ()
    passed_on: tuple[str, ...] = ()


def publisher_uses(function: Function, body: Body) -> PublisherUses:
    """Return the publishers that a method uses."""
    named = [*body.names.values(), *(call.name for call in body.calls), *body.mentioned]
    anywhere = tuple(dict.fromkeys(port for port, _ in _publishers(named)))
    if not anywhere:
        return PublisherUses()
    return PublisherUses(
        always=_once_each(_unconditional(function, body)),
        anywhere=anywhere,
        passed_on=tuple(
            dict.fromkeys(
                port for port, rest in _publishers(body.mentioned) if rest in {"", _PUBLISH}
            )
        ),
    )


def published_port(name: str) -> str | None:
    """Return ``x`` for ``self.publishers.x.publish``."""
    return next((port for port, rest in _publishers([name]) if rest == _PUBLISH), None)


def _publishers(names: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield the ports in names of publishers, with the rest of the name."""
    for name in names:
        match = _PUBLISHER.fullmatch(name)
        if match is not None:
            yield match["port"], match["rest"]


def _unconditional(function: Function, body: Body) -> Iterator[str]:
    """Yield the ports that unconditional statements publish to, up to the first possible exit."""
    for statement in function.body:
        if isinstance(statement, ast.Expr):
            name = _published(statement.value, body)
            if name is not None:
                yield name
        elif any(isinstance(inner, _EXITS) for inner in ast.walk(statement)):
            return


def _once_each(names: Iterator[str]) -> tuple[str, ...]:
    found = list(names)
    return tuple(name for name in dict.fromkeys(found) if found.count(name) == 1)


def _published(expression: ast.expr, body: Body) -> str | None:
    if isinstance(expression, ast.Call):
        return published_port(body.full_name(expression.func))
    return None
