"""Dataclasses to JSON and back: the one form of everything that processes send each other.

A document names the version of the protocol and of ros2-composer, and the type of its content.
Another version, another type, unknown or missing fields and values of other types are refused with
a text that says what was expected. Fields with their default values are left out, since most of the
fields of a report have them.

Fields may be texts, numbers, booleans, enumerations, dataclasses, ``None``, or tuples and mappings
of these. ``Any`` stands for plain data, which is not checked.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Hashable, Mapping
from enum import Enum
from functools import cache
from itertools import cycle
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")

#: Increased with each change of a dataclass that is sent: tests compare their fields.
VERSION = 3
#: The release that has this version, for messages.
RELEASE = "0.1.0"
#: Characters of a document. The endpoints of the largest systems take some millions.
MAX_CHARACTERS = 32_000_000

_KINDS = {str: "a text", int: "an integer", float: "a number", bool: "true or false"}
_Convert = Callable[[Any], Any]


class ProtocolError(ValueError):
    """A document is not what was expected; the text says where and why."""

    def __init__(self, problem: str, place: str = "") -> None:
        super().__init__(f"{place}: {problem}" if place else problem)
        self._problem = problem
        self._place = place

    def inside(self, place: str) -> ProtocolError:
        """Return the error of the whole of which this is a part: ``nodes[3].state: ...``."""
        dot = "." if self._place and not self._place.startswith("[") else ""
        return ProtocolError(self._problem, f"{place}{dot}{self._place}")


class OtherVersionError(ProtocolError):
    """A document is of another version of the protocol; the text says what to update."""


def encode(value: Any) -> str:
    """Return a dataclass as a document, in ASCII characters."""
    kind: Any = type(value)
    document = {
        "version": VERSION,
        "release": RELEASE,
        "type": kind.__name__,
        "content": _encoder(kind)(value),
    }
    return json.dumps(document, separators=(",", ":"))


def decode(
    text: str | bytes,
    *kinds: type[T],
    limit: int = MAX_CHARACTERS,
    clean: Callable[[str], str] | None = None,
) -> T:
    """Return the dataclass in a document, which has one of the types ``kinds``.

    ``clean(text)`` is applied to all of its texts, for example to escape control characters. Raises
    ProtocolError, also for a document of more than ``limit`` characters.
    """
    if len(text) > limit:
        raise ProtocolError(f"it has {len(text)} characters, at most {limit} are read")
    try:
        document = json.loads(text)
        if clean is not None:
            document = _cleaned(document, clean)
        return _content(document, kinds)
    except ProtocolError:
        raise
    except (ValueError, RecursionError):
        raise ProtocolError("it is not JSON, or nested too deeply") from None


def _cleaned(plain: Any, clean: Callable[[str], str]) -> Any:
    if type(plain) is str:
        return clean(plain)
    if type(plain) is list:
        return [_cleaned(item, clean) for item in plain]
    if type(plain) is dict:
        return {clean(key): _cleaned(item, clean) for key, item in plain.items()}
    return plain


def _content(document: Any, kinds: tuple[type[T], ...]) -> T:
    if type(document) is not dict or not {"version", "type", "content"} <= document.keys():
        raise ProtocolError("it is not a document of ros2-composer")
    version, release, name = document["version"], document.get("release"), document["type"]
    if type(version) is not int:
        raise ProtocolError(f"expected an integer, not {_shown(version)}", "version")
    if version != VERSION:
        older = "this one" if version > VERSION else "the other one"
        raise OtherVersionError(
            f"it is of ros2-composer {_shown(release)} (protocol {_shown(version)}), this is"
            f" {RELEASE!r} (protocol {VERSION}): update {older}"
        )
    known: dict[str, Any] = {kind.__name__: kind for kind in kinds}
    if type(name) is str and name in known:
        return _decoder(known[name])(document["content"])  # type: ignore[no-any-return]
    expected = " or ".join(known)
    raise ProtocolError(f"expected {expected}, not {_shown(name)}")


@cache
def _encoder(kind: Hashable) -> _Convert:
    """Return what makes plain data of a value of a type."""
    if dataclasses.is_dataclass(kind):
        return _object_encoder(kind)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return lambda value: value.value
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is None:
        return _same
    items = [_encoder(item) for item in arguments if item not in (..., type(None))]
    if origin in (Union, UnionType):
        (convert,) = items
        return lambda value: None if value is None else convert(value)
    return _container_encoder(origin, items, is_any_length=... in arguments)


def _object_encoder(kind: Any) -> _Convert:
    hints = get_type_hints(kind)
    fields = [
        (field.name, _default(field), _encoder(hints[field.name]))
        for field in dataclasses.fields(kind)
    ]
    return lambda value: {
        name: convert(item)
        for name, default, convert in fields
        if (item := getattr(value, name)) != default
    }


def _container_encoder(origin: Any, items: list[_Convert], *, is_any_length: bool) -> _Convert:
    convert = items[-1]
    if origin is Mapping:
        return lambda value: {key: convert(item) for key, item in value.items()}
    if is_any_length:
        return lambda value: [convert(item) for item in value]
    return lambda value: [each(item) for each, item in zip(items, value, strict=True)]


def _same(value: Any) -> Any:
    return value


def _default(field: dataclasses.Field[Any]) -> Any:
    """Return the value with which a field is left out; one that equals nothing if it has none."""
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


@cache
def _decoder(kind: Hashable) -> _Convert:
    """Return what makes a value of a type of plain data, and raises ProtocolError."""
    if dataclasses.is_dataclass(kind):
        return _object_decoder(kind)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return _enumeration_decoder(kind)
    if get_origin(kind) is not None:
        return _container_decoder(get_origin(kind), get_args(kind))
    return _BASIC[kind] if kind in _BASIC else _plain_decoder(kind)


def _container_decoder(origin: Any, arguments: tuple[Any, ...]) -> _Convert:
    if origin is Mapping:
        return _mapping_decoder(arguments[1])
    if origin is tuple:
        return _tuple_decoder(arguments)
    (convert,) = (_decoder(item) for item in arguments if item is not type(None))
    return lambda plain: None if plain is None else convert(plain)


def _plain_decoder(kind: Any) -> _Convert:
    def convert(plain: Any) -> Any:
        if type(plain) is kind:
            return plain
        raise ProtocolError(f"expected {_KINDS[kind]}, not {_shown(plain)}")

    return convert


def _number_decoder(plain: Any) -> float:
    if type(plain) in (float, int):
        try:
            number = float(plain)
        except OverflowError:
            number = math.inf
        if math.isfinite(number):
            return number
    raise ProtocolError(f"expected a number, not {_shown(plain)}")


#: Those that are not of one type.
_BASIC: Mapping[Any, _Convert] = {Any: _same, float: _number_decoder}


def _enumeration_decoder(kind: type[Enum]) -> _Convert:
    values = {item.value: item for item in kind}

    def convert(plain: Any) -> Enum:
        try:
            return values[plain]
        except (KeyError, TypeError):
            expected = ", ".join(map(str, values))
            raise ProtocolError(f"expected one of {expected}, not {_shown(plain)}") from None

    return convert


def _tuple_decoder(arguments: tuple[Any, ...]) -> _Convert:
    is_any_length = arguments[-1] is ...
    converts = tuple(_decoder(item) for item in arguments if item is not ...)

    def convert(plain: Any) -> tuple[Any, ...]:
        if type(plain) is not list:
            raise ProtocolError(f"expected a list, not {_shown(plain)}")
        if not is_any_length and len(plain) != len(converts):
            raise ProtocolError(f"expected {len(converts)} items, not {len(plain)}")
        items: list[Any] = []
        try:
            for convert_item, item in zip(cycle(converts), plain, strict=False):
                items.append(convert_item(item))
        except ProtocolError as error:
            raise error.inside(f"[{len(items)}]") from None
        return tuple(items)

    return convert


def _mapping_decoder(argument: Any) -> _Convert:
    convert_item = _decoder(argument)

    def convert(plain: Any) -> dict[str, Any]:
        if type(plain) is not dict:
            raise ProtocolError(f"expected an object, not {_shown(plain)}")
        values = {}
        try:
            for key, item in plain.items():
                values[key] = convert_item(item)
        except ProtocolError as error:
            raise error.inside(f"[{_shown(key)}]") from None
        return values

    return convert


def _object_decoder(kind: Any) -> _Convert:
    hints = get_type_hints(kind)
    fields = dataclasses.fields(kind)
    converts = {field.name: _decoder(hints[field.name]) for field in fields}
    required = {field.name for field in fields if _default(field) is dataclasses.MISSING}

    def convert(plain: Any) -> Any:
        if type(plain) is not dict:
            raise ProtocolError(f"expected an object, not {_shown(plain)}")
        for names, what in ((plain.keys() - converts, "unknown"), (required - plain.keys(), "no")):
            if names:
                raise ProtocolError(f"{what} field {_shown(min(names))}")
        values = {}
        try:
            for name, item in plain.items():
                values[name] = converts[name](item)
        except ProtocolError as error:
            raise error.inside(name) from None
        return kind(**values)

    return convert


def _shown(plain: Any) -> str:
    """Return a value for messages, of limited length and without special characters."""
    if isinstance(plain, (list, dict)):
        return "a list" if isinstance(plain, list) else "an object"
    if isinstance(plain, int) and plain.bit_length() > 64:
        return "a very large integer"
    return ascii(plain[:80] if isinstance(plain, str) else plain)
