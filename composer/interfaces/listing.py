"""The text of interfaces, with nested messages."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.fast_dataclass import dataclass
from composer.interfaces.definitions import (
    Field,
    Interface,
    parts,
)
from composer.interfaces.index import Interfaces
from composer.interfaces.parser import SEPARATOR, parse_line

#: As in ros2.
_INDENT = "\t"


@dataclass(frozen=True, slots=True)
class ListingOptions:
    """What to show: the comments and empty lines of the outer message; nested messages."""

    comments: bool = True
    nested: bool = True


def listing(
    name: str, interfaces: Interfaces, options: ListingOptions, above: tuple[str, ...] = ()
) -> Iterator[str]:
    """Yield the lines of the definition ``name``, each message below the field that has its type.

    A definition without text, as in the snapshot or of OMG IDL, has no comments. A message that
    contains itself, ``above``, is not expanded again.
    """
    nested = ListingOptions(comments=False)
    for line in definition_text(name, interfaces).splitlines():
        content = line.partition("#")[0].strip()
        if options.comments:
            yield line.rstrip()
        elif content:
            yield line.partition("#")[0].rstrip()
        if not options.nested or content in ("", SEPARATOR):
            continue
        field = parse_line(content, name)
        if isinstance(field, Field) and field.type.name not in (name, *above):
            for inner in listing(field.type.name, interfaces, nested, (name, *above)):
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
