"""The definitions of messages in bags: texts that include the nested messages."""

from __future__ import annotations

from collections.abc import Iterator

from composer.interfaces import Interfaces, Message
from composer.interfaces.listing import definition_text

_SEPARATOR = "=" * 80


def full_definition(type_name: str, interfaces: Interfaces) -> str:
    """Return the definition of a message as MCAP's ``ros2msg``; empty if it is not known.

    The definitions of the messages in it follow, each after a line of ``=`` and its name.
    """
    return "\n".join(_texts(type_name, interfaces, {type_name}))


def _texts(type_name: str, interfaces: Interfaces, seen: set[str]) -> Iterator[str]:
    found = interfaces.find(type_name)
    if not isinstance(found, Message):
        return
    yield definition_text(type_name, interfaces).rstrip("\n")
    for field in found.fields:
        name = field.type.name
        if not field.type.is_primitive and name not in seen:
            seen.add(name)
            nested = list(_texts(name, interfaces, seen))
            if nested:
                yield f"{_SEPARATOR}\nMSG: {name.replace('/msg/', '/')}"
                yield from nested
