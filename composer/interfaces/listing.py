"""The text of interfaces, with nested messages."""

from __future__ import annotations

from collections.abc import Iterator

from composer.interfaces.definitions import (
    Field,
    Interface,
    parts,
)
from composer.interfaces.index import Interfaces
from composer.interfaces.parser import SEPARATOR, parse_line

#: As in ros2.
_INDENT = "\t"


def listing(
    name: str, interfaces: Interfaces, *, comments: bool = True, above: tuple[str, ...] = ()
) -> Iterator[str]:
    """Yield the lines of the definition ``name``, each message below the field that has its type.

    ``comments`` are the comments of the outer message, with its empty lines.

    A definition without text, as in the snapshot or of OMG IDL, has no comments. A message that
    contains itself, ``above``, is not expanded again.
    """
    for line in definition_text(name, interfaces).splitlines():
        content = line.partition("#")[0].strip()
        if comments:
            yield line.rstrip()
        elif content:
            yield line.partition("#")[0].rstrip()
        if content in ("", SEPARATOR):
            continue
        field = parse_line(content, name)
        if isinstance(field, Field) and field.type.name not in (name, *above):
            within = (name, *above)
            for inner in listing(field.type.name, interfaces, comments=False, above=within):
                yield f"{_INDENT}{inner}" if inner else ""


def definition_text(name: str, interfaces: Interfaces) -> str:
    """Return the text of a definition, made from its description if need be; empty if unknown."""
    text = interfaces.text(name)
    found = interfaces.find(name)
    if text is None and found is not None:
        return "\n".join(_generated(found))
    return text or ""


def _generated(interface: Interface) -> Iterator[str]:
    for number, message in enumerate(parts(interface).values()):
        if number:
            yield SEPARATOR
        yield from (f"{item.type} {item.name}={item.value}" for item in message.constants)
        yield from map(_field_line, message.fields)


def _field_line(field: Field) -> str:
    return f"{field.type} {field.name}{'' if field.default is None else f' {field.default}'}"
