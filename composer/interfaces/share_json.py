"""Read the type descriptions that rosidl installs (``share/<package>/msg/<Name>.json``).

They are needed for packages that are written in OMG IDL and have no ``.msg`` text. They hold no
constants. The layout is that of type_description_interfaces/msg/TypeDescription.
"""

from __future__ import annotations

import ast
import json
from collections.abc import Mapping
from typing import Any

from composer.interfaces.definitions import Field, FieldType, Interface, Message, interface_of
from composer.language.tree import Plain

#: type_description_interfaces/msg/FieldType, numbers 1 to 22; arrays add 48, 96 or 144 to them.
_TYPE_NAMES: Mapping[int, str] = {
    2: "int8",
    3: "uint8",
    4: "int16",
    5: "uint16",
    6: "int32",
    7: "uint32",
    8: "int64",
    9: "uint64",
    10: "float32",
    11: "float64",
    13: "uint8",
    15: "bool",
    16: "byte",
    17: "string",
    18: "wstring",
    21: "string",
    22: "wstring",
}
_NESTED = 1
_FIXED_ARRAY, _BOUNDED_SEQUENCE, _UNBOUNDED_SEQUENCE = 1, 2, 3
_ROW = 48
#: The field that rosidl adds to empty messages, because C has no empty struct.
_PLACEHOLDER = "structure_needs_at_least_one_member"


def read_description(name: str, text: str) -> Interface:
    """Return the interface ``name`` from a type description.

    Raises ValueError when the text is not one, or uses a type that ROS 2 messages do not have.
    """
    try:
        description = json.loads(text)["type_description_msg"]
        described = {
            item["type_name"]: item["fields"]
            for item in (
                *description["referenced_type_descriptions"],
                description["type_description"],
            )
        }
        return _interface(name, described)
    except (KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"not a type description: {error!r}") from None


def _interface(name: str, described: Mapping[str, list[Any]]) -> Interface:
    def part(suffix: str) -> Message:
        return Message(name + suffix, tuple(_fields(described[name + suffix])))

    return interface_of(name, part)


def _fields(described: list[Any]) -> list[Field]:
    return [
        Field(item["name"], _field_type(item["type"]), _default(item["default_value"]))
        for item in described
        if item["name"] != _PLACEHOLDER
    ]


def _field_type(described: Mapping[str, Any]) -> FieldType:
    row, number = divmod(described["type_id"], _ROW)
    name = described["nested_type_name"] if number == _NESTED else _TYPE_NAMES.get(number)
    if name is None or row > _UNBOUNDED_SEQUENCE:
        raise ValueError(f"type {described['type_id']} has no place in a message")
    return FieldType(
        name,
        is_array=row > 0,
        array_size=described["capacity"] if row == _FIXED_ARRAY else None,
        array_bound=described["capacity"] if row == _BOUNDED_SEQUENCE else None,
        string_bound=described["string_capacity"] or None,
    )


def _default(text: str) -> Plain:
    """Return a default, which the description spells as Python does."""
    if not text:
        return None
    try:
        value: Plain = ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text
    return value
