"""Forms for messages, from the definitions of interfaces: fields, ranges, defaults, constants."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

from composer.dashboard.protocol.messages import RequestError
from composer.interfaces import (
    FLOATS,
    INTEGER_RANGES,
    TEXTS,
    Field,
    FieldType,
    Interfaces,
    Message,
    parts,
)
from composer.interfaces.index import similar_interface
from composer.interfaces.parser import SEPARATOR, parse_line

_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_NUMBERS = (*INTEGER_RANGES, *FLOATS, "bool")
_MAX_DEPTH = 12
_MAX_PATHS = 500
#: The name of a part of a service or an action, and its number in the definition.
_PART = re.compile(r"_(Request|Response|Goal|Result|Feedback)$", re.ASCII)
_PART_NUMBERS = {"Request": 0, "Response": 1, "Goal": 0, "Result": 1, "Feedback": 2}
_INTEGER = re.compile(r"-?\d{1,20}", re.ASCII)
_SPECIAL = {".nan": math.nan, ".inf": math.inf, "-.inf": -math.inf}


class Forms:
    """Describes interfaces; definitions are read on first use."""

    def __init__(self, interfaces: Interfaces) -> None:
        self._interfaces = interfaces

    def form(self, name: str) -> dict[str, list[dict[str, Any]]]:
        """Return the fields of each part of an interface. Raises RequestError."""
        return {part: self._fields(message, ()) for part, message in self._parts(name).items()}

    def numeric_paths(self, name: str) -> list[str]:
        """Return the paths of all fields of a message that are numbers. Raises RequestError."""
        (message,) = self._parts(name).values()
        return list(islice(self._numbers(message, "", ()), _MAX_PATHS))

    def from_json(self, values: Mapping[str, Any], name: str, part: str) -> dict[str, Any]:
        """Return values of a form as :mod:`composer.client.messages.values` takes them.

        Large integers and infinities arrive as text, because JavaScript or JSON lacks them.
        """
        message = self._parts(name).get(part)
        return dict(values) if message is None else self._record(values, message)

    def _parts(self, name: str) -> dict[str, Message]:
        found = self._interfaces.find(name)
        if found is None:
            folder = name.split("/")[1] if name.count("/") == 2 else "msg"
            hint = similar_interface(name, self._interfaces.names(folder))
            raise RequestError("not_installed", f"there is no type '{name:.80}'", hint)
        return parts(found)

    def _fields(self, message: Message, above: tuple[str, ...]) -> list[dict[str, Any]]:
        comments = self._comments(message)
        return [
            self._field(field, message, above) | _if_set("comment", comments.get(field.name))
            for field in message.fields
        ]

    def _field(self, field: Field, message: Message, above: tuple[str, ...]) -> dict[str, Any]:
        constants = [
            {"name": constant.name, "value": constant.value}
            for constant in message.constants
            if constant.type == field.type and _is_meant(constant.name, field, message)
        ]
        described = self._type(field.type, (*above, message.name))
        described |= _if_set("constants", constants)
        if field.default is not None:
            described["default"] = field.default
        return {"name": field.name, **described}

    def _type(self, type_: FieldType, above: tuple[str, ...]) -> dict[str, Any]:
        described: dict[str, Any] = {"type": str(type_)}
        if type_.is_array:
            kind = "bytes" if type_.name in ("byte", "uint8") else "array"
            described |= {"kind": kind, "element": self._type(type_.element, above)}
            described |= _if_set("size", type_.array_size)
            return described | _if_set("max_items", type_.array_bound)
        if type_.is_primitive:
            return described | _primitive(type_)
        if type_.name in _TIMES:
            return described | {"kind": "time"}
        inner = self._interfaces.message(type_.name)
        is_endless = type_.name in above or len(above) >= _MAX_DEPTH
        fields = [] if inner is None or is_endless else self._fields(inner, above)
        return described | {"kind": "message", "fields": fields}

    def _numbers(self, message: Message, prefix: str, above: tuple[str, ...]) -> Iterator[str]:
        """Yield the path of each number, of the first item for arrays."""
        for field in message.fields:
            path = f"{prefix}{field.name}{'[0]' if field.type.is_array else ''}"
            if field.type.name in _NUMBERS:
                yield path
            inner = None if field.type.is_primitive else self._interfaces.message(field.type.name)
            if inner is not None and field.type.name not in above and len(above) < _MAX_DEPTH:
                yield from self._numbers(inner, f"{path}.", (*above, field.type.name))

    def _record(self, values: Mapping[str, Any], message: Message) -> dict[str, Any]:
        converted = {}
        for name, value in values.items():
            field = message.field(name)
            converted[name] = value if field is None else self._value(value, field.type)
        return converted

    def _value(self, value: Any, type_: FieldType) -> Any:
        match value:
            case list() if type_.is_array:
                return [self._value(item, type_.element) for item in value]
            case Mapping() if not type_.is_primitive:
                inner = self._interfaces.message(type_.name)
                return value if inner is None else self._record(value, inner)
            case str() if type_.name in INTEGER_RANGES and _INTEGER.fullmatch(value):
                return int(value)
            case str() if type_.name in FLOATS:
                return _SPECIAL.get(value, value)
            case _:
                return value

    def _comments(self, message: Message) -> dict[str, str]:
        """Return the comment behind each field, or above it."""
        suffix = _PART.search(message.name)
        name = message.name[: suffix.start()] if suffix else message.name
        texts = re.split(rf"(?m)^{SEPARATOR}$", self._interfaces.text(name) or "")
        number = 0 if suffix is None else _PART_NUMBERS[suffix[1]]
        found: dict[str, str] = {}
        above: list[str] = []
        for line in texts[number].splitlines() if number < len(texts) else ():
            content, _, comment = (part.strip() for part in line.partition("#"))
            member = parse_line(content, name) if content else None
            if isinstance(member, Field):
                found[member.name] = comment or " ".join(above)
            above = [*above, comment] if comment and not content else []
        return {field: comment for field, comment in found.items() if comment}


def _primitive(type_: FieldType) -> dict[str, Any]:
    if type_.name in INTEGER_RANGES:
        low, high = INTEGER_RANGES[type_.name]
        return {"kind": "integer", "default": 0, "minimum": _exact(low), "maximum": _exact(high)}
    if type_.name in FLOATS:
        return {"kind": "number", "default": 0.0}
    if type_.name in TEXTS:
        return {"kind": "string", "default": "", **_if_set("max_length", type_.string_bound)}
    return {"kind": "boolean", "default": False}


def _is_meant(constant: str, field: Field, message: Message) -> bool:
    """Return whether a constant is a value of a field: by its name, or if no other field fits."""
    if constant.startswith(f"{field.name.upper()}_"):
        return True
    named = any(
        constant.startswith(f"{other.name.upper()}_") for other in message.fields if other != field
    )
    same = [other for other in message.fields if other.type == field.type]
    return not named and len(same) == 1


def _exact(number: int) -> int | str:
    """Return an integer, as text if JavaScript would round it."""
    return number if -(2**53) <= number <= 2**53 else str(number)


def _if_set(key: str, value: Any) -> dict[str, Any]:
    return {} if value in (None, [], "") else {key: value}
