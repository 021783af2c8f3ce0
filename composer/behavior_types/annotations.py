"""The types that annotations name."""

from __future__ import annotations

import ast
import warnings

from composer.behavior_source import Module
from composer.behavior_types.names import api_class, interface_name, own_name
from composer.behavior_types.own_classes import class_named
from composer.behavior_types.values import NONE, ApiValue, Collection, OwnObject, Value, join
from composer.field_types import ANYTHING, BOOL, INTEGER, NUMBER, STRING
from composer.interfaces import Action, Interfaces, Message, Service
from composer.model import Node, PortKind

_BUILTINS: dict[str, Value] = {"str": STRING, "int": INTEGER, "float": NUMBER, "bool": BOOL}
_LONGEST_TEXT = 200
_TRANSPARENT = frozenset({"Optional", "ClassVar", "Final"})
_COLLECTIONS: dict[str, type] = {
    "bytes": bytes,
    "dict": dict,
    "Dict": dict,
    "list": list,
    "List": list,
    "set": set,
    "Set": set,
    "tuple": tuple,
}
#: The kind of port that a value of the API belongs to.
_KINDS = {
    "Goal": PortKind.ACTION_SERVER,
    "SentGoal": PortKind.ACTION_CLIENT,
    "GoalResult": PortKind.ACTION_CLIENT,
}


def annotated(annotation: ast.expr, home: Module, node: Node, interfaces: Interfaces) -> Value:
    """Return the type that an annotation in ``home`` names, ANYTHING if it is unknown."""
    match annotation:
        case ast.Constant(value=None):
            return NONE
        case ast.Constant(value=str() as text):
            parsed = _parsed(text)
            return annotated(parsed, home, node, interfaces) if parsed is not None else ANYTHING
        case ast.BinOp(left=first, op=ast.BitOr(), right=second):
            return join(
                annotated(first, home, node, interfaces), annotated(second, home, node, interfaces)
            )
        case ast.Subscript(value=ast.Name(id=name), slice=inner) if name in _TRANSPARENT:
            return annotated(inner, home, node, interfaces)
        case ast.Subscript(value=ast.Name(id=name), slice=inner) if name in _COLLECTIONS:
            types = inner.elts if isinstance(inner, ast.Tuple) else [inner]
            parts = [annotated(item, home, node, interfaces) for item in types]
            return _collection(_COLLECTIONS[name], parts)
        case ast.Name(id=name) if name in _COLLECTIONS and name not in home.imports:
            return Collection(_COLLECTIONS[name])
        case ast.Name(id=name) if name in _BUILTINS and name not in home.imports:
            return _BUILTINS[name]
        case ast.Name(id=name) if (own := class_named(name, home)) is not None:
            return OwnObject(own)
        case ast.Name() | ast.Attribute():
            return _named(own_name(annotation, home), node, interfaces)
        case _:
            return ANYTHING


def _collection(python: type, parts: list[Value]) -> Collection:
    if python is dict and len(parts) > 1:
        return Collection(dict, parts[1], parts[0])
    is_uniform = all(part == parts[0] for part in parts)
    return Collection(python, parts[0] if is_uniform else ANYTHING)


def _parsed(text: str) -> ast.expr | None:
    if len(text) > _LONGEST_TEXT:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def _named(full: str, node: Node, interfaces: Interfaces) -> Value:
    api = api_class(full)
    if api is not None:
        ports = node.ports_of(_KINDS[api]) if api in _KINDS else ()
        return ApiValue(api, ports[0] if len(ports) == 1 else None)
    name, rest = interface_name(full)
    match interfaces.find(name) if name else None:
        case Message() as message if not rest:
            return message
        case Service() as service if rest in {"Request", "Response"}:
            return service.request if rest == "Request" else service.response
        case Action() as action if rest in {"Goal", "Result", "Feedback"}:
            return {"Goal": action.goal, "Result": action.result, "Feedback": action.feedback}[rest]
        case _:
            return ANYTHING


def allows_none(annotation: ast.expr) -> bool:
    """Return whether an annotation mentions None, Optional or a text that may."""
    return any(
        (isinstance(node, ast.Constant) and (node.value is None or isinstance(node.value, str)))
        or (isinstance(node, ast.Name) and node.id == "Optional")
        for node in ast.walk(annotation)
    )
