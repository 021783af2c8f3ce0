"""The frames that a behavior looks up and broadcasts with ``self.transforms``."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.calls.arguments import api_signature
from composer.behavior_checks.messages.elements import parameter_read
from composer.behavior_source import BehaviorSource
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.values import ApiMethod, ApiValue
from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.model import Node
from composer.source import Located, Span

BROADCAST = "broadcast"
_FRAMES = frozenset({"target", "source", "child"})


@dataclass(frozen=True, slots=True)
class FrameUse:
    """A call of ``self.transforms``, with the frames whose IDs are known.

    ``is_complete`` is true if the IDs of all of its frames are known.
    """

    method: str  # lookup, wait, can_lookup or broadcast
    span: Span
    frames: tuple[Located[str], ...]
    is_complete: bool


def frame_uses(node: Node, source: BehaviorSource, interfaces: Interfaces) -> Iterator[FrameUse]:
    """Yield the calls of ``self.transforms`` in the methods of a behavior.

    The ID of a frame is known if it is a constant or a parameter of the node.
    """
    types = BehaviorTypes(node, source, interfaces)
    for home, known in source.own_classes:
        for method in known.methods:
            scope = types.scope(method, home)
            if scope is None or method.node is None:
                continue
            for call in nodes_of(method.node):
                if isinstance(call, ast.Call):
                    yield from _use(call, scope)


def _use(call: ast.Call, scope: FunctionTypes) -> Iterator[FrameUse]:
    match scope.type_of(call.func):
        case ApiMethod(owner=ApiValue(class_name="Transforms" as owner), member=member):
            bound = api_signature(owner, member.name).bound(call)
            given = [_frame(value, scope) for name, value in bound if name in _FRAMES]
            frames = tuple(frame for frame in given if frame is not None)
            span = span_of(call.func, scope.home.source)
            yield FrameUse(member.name, span, frames, len(frames) == len(given))


def _frame(node: ast.expr, scope: FunctionTypes) -> Located[str] | None:
    """Return the ID of a frame, at its place in the code."""
    parameter = parameter_read(node, scope)
    value: object = getattr(node, "value", None) if isinstance(node, ast.Constant) else None
    if parameter is not None and parameter.value is not None:
        value = parameter.value.value
    return Located(value, span_of(node, scope.home.source)) if isinstance(value, str) else None
