"""A scope and the definitions that the tests of static typing use."""

from __future__ import annotations

from composer.base.diagnostics import Diagnostic
from composer.base.source import SourceFile, Span
from composer.interfaces import Field, FieldType, Interfaces, Message
from composer.interfaces.field_types.checker import FieldChecker
from composer.interfaces.field_types.types import (
    INTEGER,
    NUMBER,
    STRING,
    Scope,
    parameter_type,
    type_of,
)
from composer.interfaces.sources import Bundle
from composer.language.templates import Template, compile_template
from composer.language.tree import Entry, Mapping, Scalar, ScalarValue, Sequence, Tree

INTERFACES = Interfaces([Bundle()])
FILE = SourceFile("system.yaml")


def definition(name: str) -> Message:
    message = INTERFACES.message(name)
    assert message is not None
    return message


EVERYTHING = Message(
    "demo_msgs/msg/Everything",
    (
        Field("on", FieldType("bool")),
        Field("small", FieldType("uint8")),
        Field("raw", FieldType("byte")),
        Field("big", FieldType("int64")),
        Field("single", FieldType("float32")),
        Field("double", FieldType("float64")),
        Field("text", FieldType("string")),
        Field("short_text", FieldType("string", string_bound=3)),
        Field("three", FieldType("float64", is_array=True, array_size=3)),
        Field("few", FieldType("int8", is_array=True, array_bound=2)),
        Field("many", FieldType("string", is_array=True)),
        Field("stamp", FieldType("builtin_interfaces/msg/Time")),
        Field("point", FieldType("geometry_msgs/msg/Point")),
        Field("points", FieldType("geometry_msgs/msg/Point", is_array=True)),
        Field("foreign", FieldType("unknown_msgs/msg/Thing")),
    ),
)

SCOPE: Scope = {
    "message": EVERYTHING,
    "point": FieldType("geometry_msgs/msg/Point"),
    "count": INTEGER,
    "now": NUMBER,
    "node": STRING,
    "parameters": {
        "rate_hz": parameter_type("double"),
        "names": parameter_type("string_array"),
        "odd": parameter_type("oddity"),
        "camera.fps": parameter_type("integer"),
    },
    "state": {
        "last_s": type_of(0.0),
        "seen_count": type_of(0),
        "seen": type_of(True),
        "free": type_of(None),
    },
}
CHECKER = FieldChecker(INTERFACES, SCOPE)


def tree(value: object) -> Tree:
    """Return plain data as a tree; every scalar is on a line of its own, from column 1."""
    match value:
        case dict():
            entries = (Entry(_scalar(name), tree(content)) for name, content in value.items())
            return Mapping(tuple(entries), Span(FILE, 1, 1))
        case list():
            return Sequence(tuple(tree(item) for item in value), Span(FILE, 1, 1))
        case None | bool() | int() | float() | str():
            return _scalar(value)
        case _:
            raise TypeError(value)


def _scalar(value: ScalarValue) -> Scalar:
    return Scalar(value, Span(FILE, 1, 1, max(len(str(value)), 1)))


def template(value: object) -> Template:
    compiled, problems = compile_template(tree(value))
    assert compiled is not None, problems
    return compiled


def problems_of(value: object, message: Message = EVERYTHING) -> list[Diagnostic]:
    return list(CHECKER.template(template(value), message))
