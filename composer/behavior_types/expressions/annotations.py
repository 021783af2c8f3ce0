"""The types that annotations name."""

from __future__ import annotations

import ast
import warnings
from collections import Counter, deque
from collections.abc import AsyncIterator, Iterable, Iterator, Mapping, Sequence
from types import GeneratorType

from composer.behavior_source import Module
from composer.behavior_source.library import is_standard
from composer.behavior_source.method_body import dotted
from composer.behavior_types.libraries.numpy_types import numpy_class
from composer.behavior_types.libraries.rclpy_api import rclpy_class
from composer.behavior_types.syntax.lineage import class_named
from composer.behavior_types.syntax.names import alias_named, api_class, interface_name, own_name
from composer.behavior_types.values import (
    NONE,
    AnyFunction,
    ApiValue,
    Collection,
    OwnObject,
    Value,
    join,
    join_all,
)
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
_GENERIC: dict[str, type] = {
    "collections.Counter": Counter,
    "collections.OrderedDict": dict,
    "collections.defaultdict": dict,
    "typing.DefaultDict": dict,
    "typing.Deque": deque,
    "collections.deque": deque,
    "collections.abc.AsyncGenerator": AsyncIterator,
    "collections.abc.AsyncIterator": AsyncIterator,
    "collections.abc.Generator": GeneratorType,
    "collections.abc.Iterable": Iterable,
    "collections.abc.Iterator": Iterator,
    "collections.abc.Mapping": Mapping,
    "collections.abc.MutableMapping": Mapping,
    "collections.abc.Sequence": Sequence,
    "typing.AsyncGenerator": AsyncIterator,
    "typing.AsyncIterator": AsyncIterator,
    "typing.Counter": Counter,
    "typing.FrozenSet": frozenset,
    "typing.Generator": GeneratorType,
    "typing.Iterable": Iterable,
    "typing.Iterator": Iterator,
    "typing.Mapping": Mapping,
    "typing.MutableMapping": Mapping,
    "typing.OrderedDict": dict,
    "typing.Sequence": Sequence,
}
_FUNCTIONS = frozenset({"collections.abc.Callable", "typing.Callable"})
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
        case ast.Subscript(value=ast.Name(id=name)) if own := class_named(name, home):
            return OwnObject(own)
        case ast.Subscript(value=ast.Name(id=name), slice=inner) if _is_collection(name, home):
            types = inner.elts if isinstance(inner, ast.Tuple) else [inner]
            parts = [annotated(item, home, node, interfaces) for item in types]
            has_length = not any(_is_ellipsis(item) for item in types)
            return _collection(_COLLECTIONS[name], parts, has_length=has_length)
        case ast.Subscript(value=generic, slice=ast.Tuple(elts=[takes, gives])) if (
            own_name(generic, home) in _FUNCTIONS
        ):
            result = annotated(gives, home, node, interfaces)
            if not isinstance(takes, ast.List):
                return AnyFunction(None, result)
            taken = (annotated(item, home, node, interfaces) for item in takes.elts)
            return AnyFunction(tuple(taken), result)
        case ast.Subscript(value=generic, slice=inner):
            python = _GENERIC.get(own_name(generic, home))
            types = inner.elts if isinstance(inner, ast.Tuple) else [inner]
            parts = [annotated(item, home, node, interfaces) for item in types]
            return _collection(python, parts) if python is not None else ANYTHING
        case ast.Name(id=name) if name in _COLLECTIONS and name not in home.imports:
            return Collection(_COLLECTIONS[name])
        case ast.Name(id=name) if name in _BUILTINS and name not in home.imports:
            return _BUILTINS[name]
        case ast.Name(id=name) if (own := class_named(name, home)) is not None:
            return OwnObject(own)
        case ast.Name(id=name) if (alias := alias_named(name, home)) is not None:
            return annotated(alias, home, node, interfaces)
        case ast.Name() | ast.Attribute():
            full = own_name(annotation, home)
            own = class_named(dotted(annotation), home) if not full.startswith("rclpy.") else None
            return OwnObject(own) if own is not None else _named(full, node, interfaces)
        case _:
            return ANYTHING


def _is_collection(name: str, home: Module) -> bool:
    """Return whether a name means a class of Python here, not one of another package."""
    imported = home.imports.get(name)
    return name in _COLLECTIONS and (imported is None or is_standard(imported.module))


def _collection(python: type, parts: list[Value], *, has_length: bool = True) -> Collection:
    if python in (dict, Mapping) and len(parts) > 1:
        return Collection(python, parts[1], parts[0])
    if python is Counter:
        return Collection(Counter, INTEGER, parts[0])
    if python in (GeneratorType, AsyncIterator) or (python is tuple and not has_length):
        return Collection(python, parts[0])
    items = tuple(parts) if python is tuple else None
    return Collection(python, join_all(parts), items=items)


def _is_ellipsis(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is Ellipsis


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
    if full.startswith("numpy."):
        return numpy_class(full)
    if full.startswith("rclpy."):
        own = rclpy_class(full)
        return OwnObject(own) if own is not None else ANYTHING
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
