"""The types of values and of field paths, and constants in YAML checked against field types."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import replace
from itertools import takewhile
from typing import TypeAlias

from composer.base.diagnostics import Diagnostic, error, shown, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import FLOATS, INTEGER_RANGES, TEXTS, FieldType, Interfaces, Message
from composer.language.expressions import map_key
from composer.language.tree import Plain, ScalarValue

UNKNOWN_FIELD = error("RC304", "unknown-field")
INVALID_VALUE = error("RC305", "invalid-value")
BOOL = FieldType("bool")
INTEGER = FieldType("int64")
NUMBER = FieldType("float64")
STRING = FieldType("string")
ValueType: TypeAlias = "FieldType | Message | Mapping[str, ValueType] | Anything"
Scope: TypeAlias = Mapping[str, ValueType]
#: rcl_interfaces/msg/ParameterType, as parameters are declared in YAML.
_PARAMETER_TYPES: Mapping[str, FieldType] = {
    "bool": BOOL,
    "integer": INTEGER,
    "double": NUMBER,
    "string": STRING,
    "byte_array": FieldType("byte", is_array=True),
    "bool_array": FieldType("bool", is_array=True),
    "integer_array": FieldType("int64", is_array=True),
    "double_array": FieldType("float64", is_array=True),
    "string_array": FieldType("string", is_array=True),
}
_SECONDS = frozenset(("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"))
_LARGEST_FLOAT32 = 3.4028235677973366e38
_LARGEST_SECONDS = 2**31
#: Maximum number of names in a hint.
_SHOWN = 6
#: Words in the names of constants that are limits, not values of a field.
_LIMITS = frozenset({"COUNT", "DEFAULT", "LENGTH", "MAX", "MIN", "NUM", "SIZE", "VERSION"})


@dataclass(frozen=True, slots=True)
class Anything:
    """A type that is unknown before run time. It fits everywhere."""


ANYTHING = Anything()


@dataclass(frozen=True, slots=True)
class Word(FieldType):
    """A string that is one of a few ``words``."""

    words: tuple[str, ...] = ()

    def problem(self, text: object) -> tuple[str, str | None] | None:
        """Return why the value is never equal to ``text``, and a hint; None if it may be."""
        if not isinstance(text, str) or text in self.words:
            return None
        return f"the value is never '{shown(text)}'", suggestion(text, self.words)


#: How an action ends.
STATUS = Word("string", words=("succeeded", "canceled", "aborted"))


def problem_at(
    span: Span, message: str, hint: str | None = None, *, missing: bool = False
) -> Diagnostic:
    """Return a problem: ``missing`` for a field or element that does not exist.

    Otherwise, it is about a value that does not fit.
    """
    rule = UNKNOWN_FIELD if missing else INVALID_VALUE
    return Diagnostic(rule, message, span, hint=hint)


@dataclass(frozen=True, slots=True)
class PathProblem:
    """A path that cannot be resolved; ``index`` is the invalid part."""

    message: str
    index: int = 0
    hint: str | None = None


def parameter_type(declared: str, choices: Iterable[Plain] = ()) -> ValueType:
    """Return the type of a parameter declared as ``declared``, one of ``choices`` if given."""
    if declared == "string" and choices:
        return Word("string", words=tuple(str(choice) for choice in choices))
    return _PARAMETER_TYPES.get(declared, ANYTHING)


def type_of(value: Plain) -> ValueType:
    """Return the type of a value in YAML, such as the initial state of a node.

    An integer state may become 0.5 later; until then it fits wherever a number does.
    """
    match value:
        case bool():
            return BOOL
        case int():
            return INTEGER
        case float():
            return NUMBER
        case str() if "${" not in value:
            return STRING
        case dict():
            return {name: type_of(content) for name, content in value.items()}
        case _:
            return ANYTHING


def resolve_path(
    root: ValueType, parts: tuple[str | int, ...], interfaces: Interfaces
) -> ValueType | PathProblem:
    """Return the type that ``parts`` lead to from ``root``, or the problem."""
    found, index = root, 0
    while index < len(parts):
        name, taken = _next_name(found, parts[index:])
        step = _element(found, name) if isinstance(name, int) else _field(found, name, interfaces)
        if isinstance(step, PathProblem):
            return replace(step, index=index)
        found, index = step, index + taken
    return found


def _next_name(type_: ValueType, parts: tuple[str | int, ...]) -> tuple[str | int, int]:
    """Return the next field, key or index of a path, and the number of its parts."""
    if not isinstance(type_, Mapping) or isinstance(parts[0], int):
        return parts[0], 1
    names = takewhile(lambda part: isinstance(part, str), parts)
    return map_key(type_, [str(name) for name in names])


def fields_of(type_: ValueType, interfaces: Interfaces) -> Message | None:
    """Return the definition of a message type; None for other types and unknown messages."""
    if isinstance(type_, Message):
        return type_
    if isinstance(type_, FieldType) and not type_.is_array and not type_.is_primitive:
        return interfaces.message(type_.name)
    return None


def is_number(type_: ValueType) -> bool:
    """Return whether values of the type are numbers."""
    return is_integer(type_) or _is_one_of(type_, FLOATS)


def is_integer(type_: ValueType) -> bool:
    """Return whether values of the type are integers."""
    return _is_one_of(type_, INTEGER_RANGES)


def is_string(type_: ValueType) -> bool:
    """Return whether values of the type are strings."""
    return _is_one_of(type_, TEXTS)


def is_bool(type_: ValueType) -> bool:
    """Return whether values of the type are bools."""
    return _is_one_of(type_, ("bool",))


def is_seconds(type_: ValueType) -> bool:
    """Return whether a number is converted to it as seconds: Time and Duration."""
    return _is_one_of(type_, _SECONDS)


def _is_one_of(type_: ValueType, names: Container[str]) -> bool:
    return isinstance(type_, FieldType) and not type_.is_array and type_.name in names


def is_array(type_: ValueType) -> bool:
    """Return whether values of the type are lists."""
    return isinstance(type_, FieldType) and type_.is_array


def described(type_: ValueType) -> str:
    """Return the name of the type in messages."""
    match type_:
        case Message(name=name):
            return name
        case FieldType():
            return str(type_)
        case Anything():
            return "unknown type"
        case _:
            return "a map"


def _field(type_: ValueType, name: str, interfaces: Interfaces) -> ValueType | PathProblem:
    if isinstance(type_, Mapping):
        found = type_.get(name)
        return (
            found
            if found is not None
            else PathProblem(f"'{name}' does not exist", hint=suggestion(name, type_))
        )
    if isinstance(type_, FieldType) and type_.is_array:
        return PathProblem(
            f"{type_} has no field '{name}'", hint="it is a list: use an index, as in [0]"
        )
    if isinstance(type_, FieldType) and type_.is_primitive:
        return PathProblem(f"{type_} has no field '{name}'", hint="it is a value, not a message")
    message = fields_of(type_, interfaces)
    if message is None:  # an unknown type or message
        return ANYTHING
    field = message.field(name)
    if field is not None:
        return field.type
    hint = suggestion(name, message.field_names)
    return PathProblem(f"{message.name} has no field '{name}'", hint=hint)


def _element(type_: ValueType, index: int) -> ValueType | PathProblem:
    if isinstance(type_, Anything):
        return ANYTHING
    if not isinstance(type_, FieldType) or not type_.is_array:
        return PathProblem(f"{described(type_)} has no elements")
    limit = type_.array_size if type_.array_size is not None else type_.array_bound
    if limit is not None and not -limit <= index < limit:
        return PathProblem(f"{type_} has no element {index}")
    return type_.element


def constant_problem(
    value: ScalarValue, type_: FieldType, interfaces: Interfaces
) -> tuple[str, str | None] | None:
    """Return why ``value`` does not fit a field, and a hint; None if it fits."""
    if type_.is_array:
        return f"{_describe(value)} where {type_} is expected", "write a list: [...]"
    if not type_.is_primitive:
        return _message_problem(value, type_, interfaces)
    if type_.name == "bool":
        fits = isinstance(value, bool)
        return (
            None if fits else (f"{_describe(value)} where bool is expected", "write true or false")
        )
    if type_.name in TEXTS:
        return _string_problem(value, type_)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"{_describe(value)} where {type_} is expected", None
    return (
        _integer_problem(value, type_)
        if type_.name in INTEGER_RANGES
        else _float_problem(value, type_)
    )


def _message_problem(
    value: ScalarValue, type_: FieldType, interfaces: Interfaces
) -> tuple[str, str | None] | None:
    if is_seconds(type_) and isinstance(value, int | float) and not isinstance(value, bool):
        fits = -_LARGEST_SECONDS <= value < _LARGEST_SECONDS
        return None if fits else (f"{value} seconds do not fit {type_}", None)
    definition = interfaces.message(type_.name)
    names = ", ".join(definition.field_names) if definition is not None else ""
    hint = f"write a map of its fields: {names}" if names else "write a map of its fields"
    return f"{_describe(value)} where {type_} is expected", hint


def _string_problem(value: ScalarValue, type_: FieldType) -> tuple[str, str | None] | None:
    if not isinstance(value, str):
        hint = f'write it in quotes: "{value}"' if value is not None else None
        return f"{_describe(value)} where {type_} is expected", hint
    if type_.string_bound is not None and len(value) > type_.string_bound:
        return f"a string of {len(value)} characters does not fit {type_}", None
    return None


def _integer_problem(value: int | float, type_: FieldType) -> tuple[str, str | None] | None:
    low, high = INTEGER_RANGES[type_.name]
    if isinstance(value, float):
        hint = f"write {int(value)}" if value.is_integer() else None
        return f"{type_} must be an integer, not {value}", hint
    if not low <= value <= high:
        return f"{value} is outside the range of {type_}", f"allowed: {low} to {high}"
    return None


def _float_problem(value: int | float, type_: FieldType) -> tuple[str, str | None] | None:
    if type_.name == "float32" and abs(value) > _LARGEST_FLOAT32:
        return f"{value} is outside the range of float32", None
    return None


def _describe(value: ScalarValue) -> str:
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case str():
            return f"the string '{shown(value)}'"
        case _:
            return f"the number {value}"


def enumerators(message: Message, field: str) -> Mapping[str, int]:
    """Return the constants that are named after the field: STATUS_IDLE for ``status``.

    Without any, they are all constants of the message if only this field has their type.
    """
    numbers = [item for item in message.constants if isinstance(item.value, int)]
    named = [item for item in numbers if item.name.startswith(f"{field.upper()}_")]
    types = {item.type for item in message.constants}
    alike = [item.name for item in message.fields if item.type in types]
    if not named and len(numbers) > 1 and len(types) == 1 and alike == [field]:
        named = numbers
    if any(_LIMITS.intersection(item.name.split("_")) for item in named):
        return {}
    return {item.name: item.value for item in named if isinstance(item.value, int)}


def enumerator_problem(message: Message, field: str, value: object) -> tuple[str, str] | None:
    """Return that a number is none of the constants for a field, and a hint; None if it may be."""
    if not isinstance(value, int) or isinstance(value, bool):
        return None
    known = enumerators(message, field)
    if not known or value in known.values() or _is_combination(value, set(known.values())):
        return None
    names = [f"{number} {name}" for name, number in known.items()]
    more = ", ..." if len(names) > _SHOWN else ""
    text = f"{message.name} has no constant for '{field}' with the value {value}"
    return text, f"valid here: {', '.join(names[:_SHOWN])}{more}"


def _is_combination(value: int, known: set[int]) -> bool:
    """Return whether the constants are flags and ``value`` is a combination of them."""
    flags = known - {0}
    if not all(flag > 0 and flag.bit_count() == 1 for flag in flags) or max(flags, default=0) < 4:
        return False
    return value & ~sum(flags) == 0
