"""Parse ``.msg``, ``.srv`` and ``.action`` files.

The language is that of docs.ros.org "About ROS 2 interfaces"; beyond it, this follows
rosidl_adapter, the parser of ROS: a ``#`` begins a comment even within quotes, and a line with an
``=`` after the name is a constant.
"""

from __future__ import annotations

import math
import re

from composer.base.diagnostics import nearest, shown
from composer.interfaces.definitions import (
    FLOATS,
    INTEGER_RANGES,
    PARTS,
    PRIMITIVES,
    TEXTS,
    Field,
    FieldType,
    Interface,
    Message,
    MessageConstant,
    interface_of,
)
from composer.language.tree import Plain, ScalarValue

_INTERFACE_NAME = re.compile(
    r"(?P<package>[a-z][a-z0-9_]*)/(?P<folder>msg|srv|action)/(?P<name>[A-Z][A-Za-z0-9]*)",
    re.ASCII,
)
_TYPE = re.compile(
    r"(?P<name>[A-Za-z][A-Za-z0-9_/]*?)(?:<=(?P<string_bound>\d{1,9}))?"
    r"(?P<array>\[(?P<limit>(?:<=)?\d{1,9})?\])?",
    re.ASCII,
)
_MESSAGE_TYPE = re.compile(
    r"(?:(?P<package>[a-z][a-z0-9_]*)/(?:msg/)?)?(?P<name>[A-Z][A-Za-z0-9]*)", re.ASCII
)
_FIELD_NAME = re.compile(r"(?!.*__)(?!.*_$)[a-z][a-z0-9_]*", re.ASCII)
_CONSTANT_NAME = re.compile(r"(?!.*__)(?!.*_$)[A-Z][A-Z0-9_]*", re.ASCII)
_QUOTED = re.compile(r"""'(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*\"""")
_UNQUOTED = re.compile(r"""[^,'"]+|[,'"]""")
#: The line between the parts of a service or an action.
SEPARATOR = "---"
#: What is written by mistake instead, also by editors.
_DASHES = "-_=*~\u2013\u2014"
_MAX_DIGITS = 100  # of an integer
_QUOTES = ("'", '"')
#: What other languages and ROS 1 call a type.
_FOREIGN_TYPES = {
    "double": "float64",
    "duration": "builtin_interfaces/Duration",
    "float": "float64",
    "int": "int32",
    "time": "builtin_interfaces/Time",
}
_BOOLEANS = {"true": True, "1": True, "false": False, "0": False}
_Lines = list[tuple[int, str]]


class DefinitionError(Exception):
    """A definition that is invalid in ROS. ``line`` counts from 1."""

    def __init__(self, message: str, line: int, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.line = line
        self.hint = hint


class _UnknownTypeError(ValueError):
    """A type that is neither primitive nor a message, with the name that was probably meant."""

    def __init__(self, name: str) -> None:
        super().__init__(f"'{shown(name)}' is neither a primitive type nor a message")
        meant = _FOREIGN_TYPES.get(name) or nearest(name, PRIMITIVES)
        self.hint = f"did you mean '{meant}'?" if meant is not None else None


def split_name(name: str) -> tuple[str, str, str] | None:
    """Return package, folder and type of ``package/msg/Type``; None when it is no such name."""
    match = _INTERFACE_NAME.fullmatch(name)
    return (match["package"], match["folder"], match["name"]) if match else None


def parse_definition(name: str, text: str) -> Interface:
    """Return the interface ``name`` (``package/msg/Type``) that ``text`` defines.

    Raises DefinitionError, and ValueError when ``name`` is not the name of an interface.
    """
    names = split_name(name)
    if names is None:
        raise ValueError(f"'{shown(name)}' is not the name of an interface")
    package, folder, _ = names
    contents = _contents(text)
    parts = _parts(contents)
    suffixes = PARTS[folder]
    if len(parts) != len(suffixes):
        raise _wrong_count(contents, folder, len(text.splitlines()) or 1)
    lines = dict(zip(suffixes, parts, strict=True))
    return interface_of(name, lambda suffix: _message(f"{name}{suffix}", package, lines[suffix]))


def parse_line(content: str, name: str) -> Field | MessageConstant | None:
    """Return the member that a line without comments defines in the interface ``name``, or None."""
    try:
        return _member(content, name.partition("/")[0])
    except ValueError:
        return None


def without_comments(text: str) -> str:
    """Return the definition without comments and empty lines."""
    return ("\n" + SEPARATOR + "\n").join(
        "\n".join(" ".join(line.split(None, 1)) for _, line in lines)
        for lines in _parts(_contents(text))
    )


def _contents(text: str) -> _Lines:
    """Return the numbered lines without comments and empty lines."""
    lines = enumerate(text.splitlines(), start=1)
    stripped = ((at, line.partition("#")[0].replace("\t", " ").strip()) for at, line in lines)
    return [(at, content) for at, content in stripped if content]


def _parts(contents: _Lines) -> list[_Lines]:
    """Return the lines of definitions between the separators."""
    parts: list[_Lines] = [[]]
    for number, content in contents:
        if content == SEPARATOR:
            parts.append([])
        else:
            parts[-1].append((number, content))
    return parts


def _wrong_count(contents: _Lines, folder: str, last_line: int) -> DefinitionError:
    """Return the error for a definition with too many or too few separators."""
    starts = [number for number, content in contents if content == SEPARATOR]
    expected = len(PARTS[folder]) - 1
    if len(starts) < expected:
        for number, content in contents:
            if content != SEPARATOR and not content.strip(_DASHES):
                message = f"'{shown(content)}' where '{SEPARATOR}' is expected"
                return DefinitionError(message, number)
    line = starts[expected] if len(starts) > expected else last_line
    message = f"a .{folder} file has {expected} lines with '{SEPARATOR}', not {len(starts)}"
    return DefinitionError(message, line)


def _message(name: str, package: str, lines: _Lines) -> Message:
    fields: list[Field] = []
    constants: list[MessageConstant] = []
    names: set[str] = set()
    for number, line in lines:
        try:
            item = _member(line, package)
        except ValueError as error:
            hint = error.hint if isinstance(error, _UnknownTypeError) else None
            raise DefinitionError(str(error), number, hint) from None
        if item.name in names:
            raise DefinitionError(f"'{shown(item.name)}' is defined twice", number)
        names.add(item.name)
        if isinstance(item, Field):
            fields.append(item)
        else:
            constants.append(item)
    return Message(name, tuple(fields), tuple(constants))


def _member(line: str, package: str) -> Field | MessageConstant:
    type_text, _, rest = line.partition(" ")
    rest = rest.strip()
    if not rest:
        raise ValueError(f"'{shown(line)}' has no name behind the type")
    type_ = _type(type_text, package)
    if "=" in rest:
        name, _, value = rest.partition("=")
        return _constant(type_, name.strip(), value.strip())
    name, _, default = rest.partition(" ")
    if not _FIELD_NAME.fullmatch(name):
        raise ValueError(
            f"'{shown(name)}' is not a field name: lower case letters, digits, single '_'"
        )
    return Field(name, type_, _default(type_, default.strip()) if default.strip() else None)


def _constant(type_: FieldType, name: str, value: str) -> MessageConstant:
    if type_.is_array or not type_.is_primitive:
        raise ValueError(f"a constant has a primitive type, not {type_}")
    if not _CONSTANT_NAME.fullmatch(name):
        raise ValueError(
            f"'{shown(name)}' is not a constant's name: upper case letters, digits, '_'"
        )
    return MessageConstant(name, type_, _value(type_, value))


def _type(text: str, package: str) -> FieldType:
    match = _TYPE.fullmatch(text)
    if match is None:
        raise ValueError(f"'{shown(text)}' is not a type")
    name, limit = match["name"], match["limit"] or ""
    string_bound = int(match["string_bound"]) if match["string_bound"] else None
    if string_bound is not None and name not in TEXTS:
        raise ValueError(f"only strings can have a maximum length, not '{shown(name)}'")
    count = int(limit.removeprefix("<=")) if limit else None
    if count == 0 or string_bound == 0:
        raise ValueError(f"'{shown(text)}' has room for nothing")
    bounded = limit.startswith("<=")
    return FieldType(
        _type_name(name, package),
        is_array=match["array"] is not None,
        array_size=None if bounded else count,
        array_bound=count if bounded else None,
        string_bound=string_bound,
    )


def _type_name(name: str, package: str) -> str:
    if name == "char":
        return "uint8"
    if name in PRIMITIVES:
        return name
    match = _MESSAGE_TYPE.fullmatch(name)
    if match is None:
        raise _UnknownTypeError(name)
    return f"{match['package'] or package}/msg/{match['name']}"


def _default(type_: FieldType, text: str) -> Plain:
    if not type_.is_primitive:
        raise ValueError(f"a field of type {type_} has no default of its own")
    if not type_.is_array:
        return _value(type_, text)
    if not (text.startswith("[") and text.endswith("]")):
        raise ValueError(f"the default of an array is a list in brackets, not {shown(text)}")
    values: list[Plain] = [_value(type_.element, item) for item in _items(text[1:-1])]
    too_many = type_.array_bound is not None and len(values) > type_.array_bound
    if too_many or type_.array_size not in (None, len(values)):
        raise ValueError(f"{len(values)} values do not fit {type_}")
    return values


def _items(text: str) -> list[str]:
    """Return the items between commas outside quotes."""
    items: list[list[str]] = [[]]
    at = 0
    unclosed: set[str] = set()  # quotes that are not closed behind ``at`` either
    while at < len(text):
        first = text[at]
        quoted = _QUOTED.match(text, at) if first in _QUOTES and first not in unclosed else None
        if quoted is None and first in _QUOTES:
            unclosed.add(first)
        part = (quoted or _UNQUOTED.match(text, at) or [first])[0]
        if part == ",":
            items.append([])
        else:
            items[-1].append(part)
        at += len(part)
    stripped = ("".join(parts).strip() for parts in items)
    return [item for item in stripped if item]


def _value(type_: FieldType, text: str) -> ScalarValue:
    name = type_.name
    if name == "bool" and text.lower() in _BOOLEANS:
        return _BOOLEANS[text.lower()]
    if name in INTEGER_RANGES:
        return _integer(name, text)
    if name in FLOATS:
        return _float(name, text)
    if name in TEXTS:
        return _text(type_, text)
    raise ValueError(f"'{shown(text)}' is not a value of type {type_}")


def _integer(name: str, text: str) -> int:
    low, high = INTEGER_RANGES[name]
    if len(text) > _MAX_DIGITS:
        raise ValueError(f"'{shown(text)}' has more than {_MAX_DIGITS} digits")
    try:
        value = int(text) if text.lstrip("+-").isdigit() else int(text, 0)
    except ValueError:
        raise ValueError(f"'{shown(text)}' is not an integer") from None
    if not low <= value <= high:
        raise ValueError(f"{value} is outside the range of {name}, {low} to {high}")
    return value


def _float(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"'{shown(text)}' is not a number") from None
    if not math.isfinite(value):
        raise ValueError(f"'{shown(text)}' is not a finite {name}")
    return value


def _text(type_: FieldType, text: str) -> str:
    if len(text) >= 2 and text[0] in _QUOTES and text[0] == text[-1]:
        quote, text = text[0], text[1:-1]
        if re.search(rf"(?<!\\){quote}", text):
            raise ValueError(f"a {quote} within the text is written \\{quote}")
        text = text.replace("\\" + quote, quote)
    if type_.string_bound is not None and len(text) > type_.string_bound:
        raise ValueError(f"{len(text)} characters do not fit {type_}")
    return text
