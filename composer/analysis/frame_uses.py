"""The frames that a behavior looks up and broadcasts with ``self.transforms``."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from composer.fast_dataclass import dataclass
from composer.model import Node
from composer.python_code.source import BehaviorSource, Scope, scopes_in
from composer.python_code.source.trees import argument, dotted, span_of
from composer.source import Located, Span

BROADCAST = "broadcast"
_TRANSFORMS = "self.transforms"
_PARAMETER = "self.parameters."
_PAIR = ((0, "target"), (1, "source"))
#: The methods of ``self.transforms``, with the position and name of each frame they take.
_METHODS: Mapping[str, tuple[tuple[int, str], ...]] = {
    "lookup": _PAIR,
    "wait": _PAIR,
    "can_lookup": _PAIR,
    "transform": ((1, "target"),),
    BROADCAST: ((0, "child"),),
}


@dataclass(frozen=True, slots=True)
class FrameUse:
    """A call of ``self.transforms``, with the frames whose IDs are known."""

    method: str
    span: Span
    frames: tuple[Located[str], ...]


def frame_uses(node: Node, source: BehaviorSource) -> Iterator[FrameUse]:
    """Yield the calls of ``self.transforms`` in the methods of a behavior.

    The ID of a frame is known if it is a constant or a parameter of the node.
    """
    for scope in scopes_in(source.own_classes):
        for call in scope.nodes:
            match call:
                case ast.Call(func=ast.Attribute(value=owner, attr=name)) if name in _METHODS:
                    if _name(owner, scope) == _TRANSFORMS:
                        given = (argument(call, *place) for place in _METHODS[name])
                        frames = (_frame(item, scope, node) for item in given if item is not None)
                        span = span_of(call.func, scope.source)
                        yield FrameUse(name, span, tuple(filter(None, frames)))


def _frame(expression: ast.expr, scope: Scope, node: Node) -> Located[str] | None:
    """Return the ID of a frame, at its place in the code."""
    name = _name(expression, scope)
    if name.startswith(_PARAMETER):
        parameter = node.parameter(name.removeprefix(_PARAMETER))
        value = parameter.value.value if parameter is not None and parameter.value else None
    else:
        value = scope.known(scope.literal, expression)
    place = span_of(expression, scope.source)
    return Located(value, place) if isinstance(value, str) else None


def _name(expression: ast.expr, scope: Scope) -> str:
    """Return the dotted name that an expression stands for; "" if there is none."""
    value = scope.known(scope.followed, expression)
    return dotted(value) if value is not None else ""
