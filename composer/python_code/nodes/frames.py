"""The frames that a behavior looks up and broadcasts with ``self.transforms``."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from composer.fast_dataclass import dataclass
from composer.model import Node
from composer.python_code.source import BehaviorSource
from composer.python_code.source.method_body import argument, dotted
from composer.python_code.source.spans import span_of
from composer.python_code.source.traversal import walk
from composer.python_code.source.values import NotLiteral, Scope
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
    for module, known in source.own_classes:
        for method in known.methods:
            if method.node is None:
                continue
            scope = Scope(module, known.node, method.node)
            for call in walk(method.node.body, closed=(ast.ClassDef,)):
                if isinstance(call, ast.Call) and _is_of_transforms(call, scope):
                    yield _use(call, scope, node)


def _is_of_transforms(call: ast.Call, scope: Scope) -> bool:
    match call.func:
        case ast.Attribute(value=value, attr=name) if name in _METHODS:
            return _name(value, scope) == _TRANSFORMS
    return False


def _use(call: ast.Call, scope: Scope, node: Node) -> FrameUse:
    method = dotted(call.func).rpartition(".")[2]
    given = (argument(call, position, name) for position, name in _METHODS[method])
    frames = (_frame(item, scope, node) for item in given if item is not None)
    known = tuple(frame for frame in frames if frame is not None)
    return FrameUse(method, span_of(call.func, scope.module.source), known)


def _frame(expression: ast.expr, scope: Scope, node: Node) -> Located[str] | None:
    """Return the ID of a frame, at its place in the code."""
    name = _name(expression, scope)
    if name.startswith(_PARAMETER):
        parameter = node.parameter(name.removeprefix(_PARAMETER))
        value = parameter.value.value if parameter is not None and parameter.value else None
    else:
        try:
            value = scope.literal(expression)
        except NotLiteral:
            value = None
    place = span_of(expression, scope.module.source)
    return Located(value, place) if isinstance(value, str) else None


def _name(expression: ast.expr, scope: Scope) -> str:
    """Return the dotted name that an expression stands for; "" if there is none."""
    try:
        return dotted(scope.followed(expression))
    except NotLiteral:
        return ""
