"""The text of interfaces, with nested messages, and messages with all fields at their defaults."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from composer.base.fast_dataclass import dataclass
from composer.interfaces.definitions import (
    FLOATS,
    TEXTS,
    Field,
    FieldType,
    Interface,
    Message,
    parts,
)
from composer.interfaces.index import Interfaces
from composer.interfaces.parser import SEPARATOR, parse_line
from composer.language.tree import Plain

#: As in ros2.
_INDENT = "\t"


@dataclass(frozen=True, slots=True)
class ListingOptions:
    """What to show: comments and empty lines, those of nested messages too, nested messages."""

    comments: bool = True
    nested_comments: bool = False
    nested: bool = True


def listing(
    name: str, interfaces: Interfaces, options: ListingOptions, above: tuple[str, ...] = ()
) -> Iterator[str]:
    """Yield the lines of the definition ``name``, each message below the field that has its type.

    A definition without text, as in the snapshot or of OMG IDL, has no comments. A message that
    contains itself, ``above``, is not expanded again.
    """
    text = interfaces.text(name)
    found = interfaces.find(name)
    if text is None and found is not None:
        text = "\n".join(_generated(found))
    nested = ListingOptions(options.nested_comments, options.nested_comments)
    for line in (text or "").splitlines():
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


def prototype(
    message: Message, interfaces: Interfaces, above: tuple[str, ...] = ()
) -> dict[str, Plain]:
    """Return a message as plain data, all fields at their defaults.

    A message that contains itself, ``above``, is empty there.
    """
    if message.name in above:
        return {}
    inside = (message.name, *above)
    return {field.name: _default(field, interfaces, inside) for field in message.fields}


def _generated(interface: Interface) -> Iterator[str]:
    for number, message in enumerate(parts(interface).values()):
        if number:
            yield SEPARATOR
        yield from (f"{item.type} {item.name}={item.value}" for item in message.constants)
        yield from map(_field_line, message.fields)


def _field_line(field: Field) -> str:
    return f"{field.type} {field.name}{'' if field.default is None else f' {field.default}'}"


def _default(field: Field, interfaces: Interfaces, above: tuple[str, ...]) -> Plain:
    if field.default is not None:
        return field.default
    if not field.type.is_array:
        return _zero(field.type, interfaces, above)
    return [_zero(field.type, interfaces, above) for _ in range(field.type.array_size or 0)]


def _zero(type_: FieldType, interfaces: Interfaces, above: tuple[str, ...]) -> Plain:
    if not type_.is_primitive:
        message = interfaces.message(type_.name)
        return {} if message is None else prototype(message, interfaces, above)
    if type_.name == "bool":
        return False
    if type_.name in TEXTS:
        return ""
    return 0.0 if type_.name in FLOATS else 0


def packages(names: Iterable[str]) -> tuple[str, ...]:
    """Return the packages of interfaces, sorted."""
    return tuple(sorted({name.partition("/")[0] for name in names}))
