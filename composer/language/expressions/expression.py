"""Compiled expressions, and the values that they read: messages, maps and lists.

A field is read only when the message's class declares it: methods and private attributes cannot be
reached. A ``byte``, which rclpy keeps as ``bytes`` of one, is an integer here.
"""

from __future__ import annotations

import ast
from array import array
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import field
from enum import Enum
from functools import lru_cache
from itertools import takewhile
from types import CodeType, TracebackType
from typing import Any, TypeAlias, cast

from composer.base.diagnostics import shown
from composer.base.fast_dataclass import dataclass

_REASONS: Mapping[type[Exception], str] = {
    KeyError: "there is no such name here",
    ZeroDivisionError: "division by zero",
    OverflowError: "the number is too large",
    TypeError: "a string and a number have no order",
    ValueError: "not defined for this value",
}
#: Returns the value of an expression with the names in a scope.
Function: TypeAlias = Callable[[Mapping[str, Any]], Any]


class ExpressionError(Exception):
    """The text is not a valid expression.

    ``offset`` and ``length`` are the invalid part in characters of the source; ``hint`` says how to
    fix it, if that is clear.
    """

    def __init__(self, message: str, offset: int = 0, length: int = 1, hint: str | None = None):
        super().__init__(message)
        self.message = message
        self.offset = offset
        self.length = max(length, 1)
        self.hint = hint


class EvaluationError(Exception):
    """The expression cannot be evaluated with the given values. The text names the part."""


class Refusal(Exception):
    """An operation does not support a value; becomes an EvaluationError."""


class Kind(Enum):
    """What a value is, to the language; the value is how an error speaks of it."""

    BOOL = "true or false"
    NUMBER = "a number"
    TEXT = "a string"
    SEQUENCE = "a list"
    MAPPING = "a map"
    MESSAGE = "a message"
    BYTES = "bytes"
    ELEMENT = "an element of an array"
    NOTHING = "nothing"
    OTHER = "a value of an unknown kind"


_KINDS: tuple[tuple[type, Kind], ...] = (
    (bool, Kind.BOOL),
    (int, Kind.NUMBER),
    (float, Kind.NUMBER),
    (str, Kind.TEXT),
    (bytes, Kind.BYTES),
    (list, Kind.SEQUENCE),
    (tuple, Kind.SEQUENCE),
    (array, Kind.SEQUENCE),
    (Mapping, Kind.MAPPING),
    (type(None), Kind.NOTHING),
)


def _kind_of(cls: type) -> Kind:
    if _is_numpy(cls, "generic"):  # numpy.float64 is a float too, and must become a plain one
        return Kind.ELEMENT
    if _is_numpy(cls, "ndarray"):
        return Kind.SEQUENCE
    for base, kind in _KINDS:
        if issubclass(cls, base):
            return kind
    return Kind.MESSAGE if _message_fields(cls) is not None else Kind.OTHER


def _is_numpy(cls: type, name: str) -> bool:
    """Say whether ``cls`` is numpy's, without importing numpy."""
    return any(base.__module__ == "numpy" and base.__name__ == name for base in cls.__mro__)


def _message_fields(cls: type) -> frozenset[str] | None:
    declared = vars(cls).get("_fields_and_field_types")
    if not isinstance(declared, dict):
        return None
    return frozenset(name for name in declared if not name.startswith("_"))


#: What values of a class are.
kind_of = cast("Callable[[type], Kind]", lru_cache(maxsize=1024)(_kind_of))
#: The fields of a generated message class; None for any other class.
message_fields = cast(
    "Callable[[type], frozenset[str] | None]", lru_cache(maxsize=1024)(_message_fields)
)


def describe(value: Any) -> str:
    """Return how an error speaks of ``value``: never the value itself, which may be huge."""
    kind = kind_of(type(value))
    return type(value).__name__ if kind is Kind.MESSAGE else kind.value


def plain(value: Any) -> Any:
    """Return a byte as an integer, an element of a numpy array as Python's own, all else as is."""
    if type(value) is bytes and len(value) == 1:
        return value[0]
    return value.item() if kind_of(type(value)) is Kind.ELEMENT else value


def map_key(known: Container[str], names: Sequence[str]) -> tuple[str, int]:
    """Return the key of a map that ``names`` begin with, and how many of them it takes.

    Names of ROS parameters may have dots in them, so ``parameters.camera.fps`` reads ``camera.fps``
    where there is such a key. The longest key wins; without any the first name is returned.
    """
    for count in range(len(names), 1, -1):
        key = ".".join(names[:count])
        if key in known:
            return key, count
    return names[0], 1


def read_fields(value: Any, names: tuple[str, ...]) -> Any:
    """Return what is reached through the field names."""
    if message_fields(type(value)) is None:
        value, names = _read_maps(value, names)
    for name in names:
        known = message_fields(type(value))
        if known is None or name not in known:
            raise Refusal(f"{describe(value)} has no field '{name}'")
        value = getattr(value, name)
    return plain(value) if type(value) is bytes else value


def read_path(value: Any, steps: tuple[tuple[str, ...] | int, ...]) -> Any:
    """Return what is reached through runs of field names and indices between them."""
    for step in steps:
        value = _read_index(value, step) if isinstance(step, int) else read_fields(value, step)
    return value


def _read_maps(value: Any, names: tuple[str, ...]) -> tuple[Any, tuple[str, ...]]:
    """Return the first value on the path that is not a map, and the remaining names."""
    while names and kind_of(type(value)) is Kind.MAPPING:
        key, count = map_key(value, names)
        if key not in value:
            raise Refusal(f"there is no '{key}'")
        value, names = value[key], names[count:]
    return value, names


def _read_index(value: Any, index: int) -> Any:
    if kind_of(type(value)) is not Kind.SEQUENCE:
        raise Refusal(f"{describe(value)} has no elements")
    if not -len(value) <= index < len(value):
        raise Refusal(f"there is no element {index} in a list of {len(value)}")
    return plain(value[index])


def _is_name(part: str | int) -> bool:
    return isinstance(part, str)


@dataclass(frozen=True, slots=True)
class FieldPath:
    """A use of a name: ``("message", "poses", 0, "pose")``.

    ``offset`` and ``length`` count characters of the source.
    """

    parts: tuple[str | int, ...]
    offset: int = field(compare=False)
    length: int = field(compare=False)

    @property
    def root(self) -> str:
        """The name in scope at the start of the path."""
        return str(self.parts[0])

    def key(self, known: Container[str]) -> str:
        """Return the key that the path reads from its root, a map with the keys ``known``."""
        names = tuple(str(part) for part in takewhile(_is_name, self.parts[1:]))
        return map_key(known, names)[0] if names else ""

    def __str__(self) -> str:
        steps = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in self.parts[1:])
        return self.root + "".join(steps)


@dataclass(frozen=True, slots=True)
class Expression:
    """A compiled expression. Expressions with the same source are equal.

    ``tree`` is its syntax tree, for type inference; columns in it count
    characters of the source. ``compile`` returns its
    ``function``, which is made when it is first evaluated.
    """

    source: str
    paths: tuple[FieldPath, ...] = field(compare=False)
    tree: ast.expr = field(compare=False, repr=False)
    compile: Callable[[], Function] = field(compare=False, repr=False)
    function: Function | None = field(default=None, compare=False, repr=False)

    def evaluate(self, scope: Mapping[str, Any]) -> Any:
        """Return the value with the names in ``scope``: messages and maps are read, not changed.

        Raises EvaluationError, and nothing else, when there is none.
        """
        try:
            return (self.function or self._compiled())(scope)
        except Exception as error:
            raise EvaluationError(self._explain(error)) from error

    def holds(self, scope: Mapping[str, Any]) -> bool:
        """Return the value of a condition. Raises EvaluationError unless it is a boolean."""
        value = self.evaluate(scope)
        if not isinstance(value, bool):
            message = f"'{shown(self.source)}': {describe(value)} where true or false is expected"
            raise EvaluationError(message)
        return value

    def __str__(self) -> str:
        return self.source

    def _compiled(self) -> Function:
        function = self.compile()
        object.__setattr__(self, "function", function)
        return function

    def _explain(self, error: Exception) -> str:
        code: CodeType = (self.function or self._compiled()).__code__
        part = _failed_part(self.source, code, error.__traceback__)
        return f"'{shown(part)}': {_reason(error)}"


def _reason(error: Exception) -> str:
    if isinstance(error, Refusal):
        return str(error)
    reason = _REASONS.get(type(error))
    return reason or f"{type(error).__name__} while the value was read"


def _failed_part(source: str, code: CodeType, traceback: TracebackType | None) -> str:
    """Return the part of the source that failed, from the code's position table."""
    while traceback is not None and traceback.tb_frame.f_code is not code:
        traceback = traceback.tb_next
    if traceback is None:
        return source
    _, _, start, end = list(code.co_positions())[traceback.tb_lasti // 2]
    return source if start is None or end is None else source[start:end]
