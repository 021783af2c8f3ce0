"""The types of values in behaviors, beyond those of message fields."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from typing import TypeAlias

from composer.behavior_source import Class, Method, Module
from composer.behavior_types.api import Member
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING, ValueType
from composer.interfaces import Action, Message, Service
from composer.model import Port, PortKind


@dataclass(frozen=True, slots=True)
class NoneType:
    """The type of None."""


NONE = NoneType()


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

    ``element`` is the type of the values of a dict, and ``key`` that of its keys.
    """

    python: type
    element: Value = ANYTHING
    key: Value = ANYTHING


@dataclass(frozen=True, slots=True)
class CollectionMethod:
    """A method of a collection."""

    owner: Collection
    name: str


@dataclass(frozen=True, slots=True)
class OwnClass:
    """A class in a file of the behavior, other than that of the behavior."""

    definition: Class
    home: Module


@dataclass(frozen=True, slots=True)
class OwnObject:
    """An object of such a class."""

    of: OwnClass


@dataclass(frozen=True, slots=True, eq=False)
class OwnMethod:
    """A method of the behavior."""

    method: Method
    home: Module


@dataclass(frozen=True, slots=True, eq=False)
class ModuleFunction:
    """A function of the behavior's module, or a method of an object of a class in it."""

    node: ast.FunctionDef | ast.AsyncFunctionDef
    home: Module
    is_bound: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Pending:
    """What an asynchronous ``call`` returns; waiting for it gives ``result``."""

    name: str
    call: ast.Call
    result: Value


Value: TypeAlias = (
    "ValueType | NoneType | Self | Ports | Parameters | InterfaceClass | ApiValue | ApiMethod"
    " | OwnMethod | ModuleFunction | Pending | Collection | CollectionMethod | OwnClass | OwnObject"
)


def join(first: Value, second: Value) -> Value:
    """Return the type of a value that is of one of two types; None is disregarded."""
    if first == second or second is NONE:
        return first
    if isinstance(first, Collection) and isinstance(second, Collection):
        if first.python is second.python:
            element, key = join(first.element, second.element), join(first.key, second.key)
            return Collection(first.python, element, key)
        return ANYTHING
    return second if first is NONE else ANYTHING


def join_all(found: Iterable[Value]) -> Value:
    """Return the type of a value that is of one of several types, ANYTHING if there is none."""
    result: Value | None = None
    for type_ in found:
        result = type_ if result is None else join(result, type_)
    return ANYTHING if result is None else result
