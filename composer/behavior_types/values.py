"""The types of values in behaviors, beyond those of message fields."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from typing import TypeAlias

from composer.behavior_source import Class, Method, Module
from composer.behavior_types.api import Member
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING, INTEGER, NUMBER, STRING, ValueType
from composer.interfaces import FLOATS, INTEGER_RANGES, TEXTS, Action, FieldType, Message, Service
from composer.model import Port, PortKind


@dataclass(frozen=True, slots=True)
class NoneType:
    """The type of None."""


NONE = NoneType()

#: The types of message fields whose values are ints of Python: a byte is bytes of length 1.
INTEGERS = frozenset(INTEGER_RANGES) - {"byte"}


@dataclass(frozen=True, slots=True)
class Self:
    """The behavior itself."""


@dataclass(frozen=True, slots=True)
class Ports:
    """``self.publishers``, ``self.clients`` or ``self.action_clients``."""

    kind: PortKind


@dataclass(frozen=True, slots=True)
class Parameters:
    """``self.parameters``."""


@dataclass(frozen=True, slots=True)
class InterfaceClass:
    """A class of messages, services or actions."""

    definition: Message | Service | Action


@dataclass(frozen=True, slots=True)
class ApiValue:
    """A value of a class of the API; ``port`` is the port that it belongs to, if it is known."""

    class_name: str
    port: Port | None = None


@dataclass(frozen=True, slots=True)
class ApiMethod:
    """A method of a value of the API."""

    owner: ApiValue
    member: Member


@dataclass(frozen=True, slots=True)
class Collection:
    """A list, dict, set, tuple or bytes of Python, with the type of its elements.

    ``element`` is the type of the values of a dict, and ``key`` that of its keys. ``items`` are the
    types of the elements of a tuple whose length is known. ``is_empty`` is true for ``[]``, which
    may get elements of any type.
    """

    python: type
    element: Value = ANYTHING
    key: Value = ANYTHING
    items: tuple[Value, ...] | None = None
    is_empty: bool = False


def pair(*items: Value) -> Collection:
    """Return the type of a tuple of these elements."""
    return Collection(tuple, join_all(items), items=items)


@dataclass(frozen=True, slots=True)
class BuiltinObject:
    """An object of a class of Python that has no attributes but those of its class."""

    python: type


@dataclass(frozen=True, slots=True)
class BuiltinMethod:
    """A method of such an object."""

    python: type
    name: str


@dataclass(frozen=True, slots=True)
class CollectionMethod:
    """A method of a collection."""

    owner: Collection
    name: str


@dataclass(frozen=True, slots=True)
class OwnClass:
    """A class in a file of the behavior, other than that of the behavior, or a class of rclpy."""

    definition: Class
    home: Module


@dataclass(frozen=True, slots=True)
class OwnObject:
    """An object of such a class.

    ``parameter`` is the interface that an object of rclpy was created for, or what a future gives.
    """

    of: OwnClass
    parameter: Value = ANYTHING


@dataclass(frozen=True, slots=True)
class OwnModule:
    """A file of the project that another one imports."""

    module: Module


@dataclass(frozen=True, slots=True, eq=False)
class OwnMethod:
    """A method of the behavior."""

    method: Method
    home: Module


@dataclass(frozen=True, slots=True, eq=False)
class ModuleFunction:
    """A function of the behavior's module, or a method of an object of a class in it.

    ``parameter`` is that of the object, and ``of`` its class, if it is one of the project.
    """

    node: ast.FunctionDef | ast.AsyncFunctionDef
    home: Module
    is_bound: bool = False
    parameter: Value = ANYTHING
    of: OwnClass | None = None


@dataclass(frozen=True, slots=True)
class AnyFunction:
    """A function that an annotation describes, as in ``Callable[[float], str]``.

    ``arguments`` are the types that it is called with, None if they are not known.
    """

    arguments: tuple[Value, ...] | None = None
    result: Value = ANYTHING


@dataclass(frozen=True, slots=True, eq=False)
class Pending:
    """What an asynchronous ``call`` returns; waiting for it gives ``result``."""

    name: str
    call: ast.Call
    result: Value


Value: TypeAlias = (
    "ValueType | NoneType | Self | Ports | Parameters | InterfaceClass | ApiValue | ApiMethod"
    " | OwnMethod | ModuleFunction | Pending | Collection | CollectionMethod | OwnClass | OwnObject"
    " | AnyFunction | BuiltinObject | BuiltinMethod | OwnModule"
)


def join(first: Value, second: Value) -> Value:
    """Return the type of a value that is of one of two types; None is disregarded."""
    if first == second or second is NONE:
        return first
    if first is NONE:
        return second
    if isinstance(first, Collection) and isinstance(second, Collection):
        return _join_collections(first, second)
    if isinstance(first, FieldType) and isinstance(second, FieldType):
        return _join_fields(first, second)
    if isinstance(first, ApiValue) and isinstance(second, ApiValue):
        return _join_ports(first, second)
    return ANYTHING


def _join_collections(first: Collection, second: Collection) -> Value:
    if first.python is not second.python:
        return ANYTHING
    if first.is_empty or second.is_empty:
        return second if first.is_empty else first
    items = None
    one, other = first.items, second.items
    if one is not None and other is not None and len(one) == len(other):
        items = tuple(map(join, one, other))
    element, key = join(first.element, second.element), join(first.key, second.key)
    return Collection(first.python, element, key, items)


def _join_ports(first: ApiValue, second: ApiValue) -> Value:
    """Return the type of one of two values of the API: that of the first if they are alike."""
    ports = first.port, second.port
    if first.class_name != second.class_name:
        return ANYTHING
    types = {port.interface.value if port is not None else None for port in ports}
    return first if len(types) == 1 else ApiValue(first.class_name)


def _join_fields(first: FieldType, second: FieldType) -> Value:
    """Return the type of numbers or texts of different size, which are the same in Python."""
    if first.is_array or second.is_array:
        return ANYTHING
    for names, general in ((FLOATS, NUMBER), (INTEGERS, INTEGER), (TEXTS, STRING)):
        if first.name in names and second.name in names:
            return general
    return ANYTHING


def join_all(found: Iterable[Value]) -> Value:
    """Return the type of a value that is of one of several types, ANYTHING if there is none."""
    result: Value | None = None
    for type_ in found:
        result = type_ if result is None else join(result, type_)
    return ANYTHING if result is None else result
