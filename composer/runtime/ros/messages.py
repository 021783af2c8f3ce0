"""Builds ROS messages from templates and plain data, and returns messages as plain data.

A template is compiled once for its message type, and constants are converted then. Conversions
follow the rule of parameters: an integer is accepted for a floating-point number, and nothing else
is converted, except that a number for a Time or a Duration means seconds.
"""

from __future__ import annotations

import sys
import threading
from array import array
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Any, TypeAlias

from rclpy.exceptions import NoTypeSupportImportedException
from rclpy.type_support import check_for_type_support
from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractString,
    AbstractWString,
    Array,
    BasicType,
    BoundedSequence,
    BoundedString,
    NamespacedType,
    UnboundedSequence,
)

from composer.base.diagnostics import suggestion
from composer.interfaces.parser import split_name
from composer.interfaces.sources import installed_prefixes
from composer.language.templates import Computed, Constant, Items, Record, Template, Text, evaluate

# Every message class imports rosidl_generator_py, which also imports its generator, with a parser
# and a template engine: 50 ms of CPU time. The package leaves out a generator that cannot be
# imported, as is the case where only what programs need at run time is installed. This has to run
# before the first type support is loaded. See docs/decisions/0014-start-up.md.
_GENERATOR = "rosidl_generator_py.generate_py_impl"
_is_hidden = _GENERATOR not in sys.modules
if _is_hidden:
    sys.modules[_GENERATOR] = None  # type: ignore[assignment]  # importlib: it cannot be imported
from rosidl_generator_py.import_type_support_impl import UnsupportedTypeSupport  # noqa: E402

if _is_hidden:
    del sys.modules[_GENERATOR]

Scope: TypeAlias = Mapping[str, Any]
Build: TypeAlias = Callable[[Scope], Any]
Convert: TypeAlias = Callable[[Any], Any]

_SECONDS_TYPES = ("builtin_interfaces/Time", "builtin_interfaces/Duration")
_NANOSECONDS = 1_000_000_000
_INTEGER_RANGES = {
    f"{sign}int{bits}": (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for bits in (8, 16, 32, 64)
    for sign in ("", "u")
} | {"char": (0, 255)}
_TYPECODES = {
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float": "f",
    "double": "d",
}


_NOT_INSTALLED = (
    ImportError,
    AttributeError,
    ValueError,
    NoTypeSupportImportedException,
    UnsupportedTypeSupport,
)
#: A class loads its own type support first and that of its fields after it. If another thread
#: uses the class in between, its fields have none, and rclpy can neither take nor send.
_LOADING = threading.Lock()


class MessageError(Exception):
    """A value does not fit its field; the text names both.

    ``hint`` suggests a similar name.
    """

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


def load_type_support(interface: Any) -> None:
    """Load the type support of a message, service or action class. Thread-safe."""
    with _LOADING:
        check_for_type_support(interface)


@cache
def interface_class(name: str) -> Any:
    """Return the class of ``package/folder/Name``, ready for use on any thread.

    The name may be one that rosidl derives from a service or an action, as ``Trigger_Event``. Only
    packages that the ament index lists are imported, because names also come from the ROS graph:
    any node can announce ``antigravity/msg/Any``. Raises MessageError when the interface is not
    installed.
    """
    folder_path, _, derived_name = name.rpartition("/")
    parts = split_name(f"{folder_path}/{derived_name.partition('_')[0]}")
    if parts is None:
        raise MessageError(f"'{name}' is not the name of an interface")
    package, folder, class_name = parts
    if not any(prefix.has_package(package) for prefix in installed_prefixes()):
        raise MessageError(
            f"interface '{name}' is not installed: no package '{package}' in the ament index"
        )
    try:
        message_class = getattr(import_module(f"{package}.{folder}"), class_name)
        load_type_support(message_class)
        if derived_name != class_name:
            message_class = getattr(import_module(message_class.__module__), derived_name)
            load_type_support(message_class)
    except _NOT_INSTALLED as error:
        raise MessageError(f"interface '{name}' is not installed for Python: {error}") from error
    return message_class


def compile_message(template: Template, message_type: Any, what: str) -> Build:
    """Return a function that builds a ``message_type`` from a scope.

    ``what`` names the message in errors, for example ``publish to 'chatter'``. Raises MessageError
    for errors that do not depend on the scope. The function raises MessageError and
    EvaluationError.
    """
    match template:
        case Record():
            return _record(template, message_type, what)
        case Computed():
            return _computed(template, _message_converter(message_type, what))
        case _:
            raise MessageError(f"{what}: {_type_name(message_type)} is made of a map of fields")


def convert_message(values: Mapping[str, Any], message_type: Any, what: str) -> Any:
    """Return a message with these values; other fields keep their defaults. Raises MessageError.

    Nothing is evaluated: a string is a string.
    """
    types = _field_types(message_type)
    message = message_type()
    for name, content in values.items():
        if name not in types:
            raise _no_field(what, message_type, name)
        setattr(message, name, _converter(types[name], _field_path(what, name))(content))
    return message


def to_plain(value: Any) -> Any:
    """Return a message, or a part of one, as dicts, lists and scalars."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: to_plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value)
    if isinstance(value, array) or hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [to_plain(item) for item in value]
    return value


def _record(template: Record, message_type: Any, where: str) -> Build:
    types = _field_types(message_type)
    constants: list[tuple[str, Build]] = []
    setters: list[tuple[str, Build]] = []
    for name, content in template.fields:
        if name.value not in types:
            raise _no_field(where, message_type, name.value)
        build = _field(content, types[name.value], _field_path(where, name.value))
        (constants if isinstance(content, Constant) else setters).append((name.value, build))
    values = [(name, build({})) for name, build in constants]

    def build_record(scope: Scope) -> Any:
        message = message_type()
        for name, value in values:
            setattr(message, name, value)
        for name, build in setters:
            setattr(message, name, build(scope))
        return message

    return build_record


def _field(template: Template, field_type: Any, where: str) -> Build:
    match template:
        case Record() if isinstance(field_type, NamespacedType):
            return _record(template, _message_class(field_type), where)
        case Record():
            raise MessageError(f"{where} is {_kind_of(field_type)}, not a map of fields")
        case Items() if isinstance(field_type, AbstractNestedType):
            return _items(template, field_type, where)
        case Items():
            raise MessageError(f"{where} is {_kind_of(field_type)}, not a list")
        case Constant():
            constant = _converter(field_type, where)(template.value)
            return lambda _: constant
        case Computed() | Text():
            return _computed(template, _converter(field_type, where))


def _computed(template: Computed | Text, convert_value: Convert) -> Build:
    if isinstance(template, Text):
        return lambda scope: convert_value(evaluate(template, scope))
    compute = template.expression.evaluate
    return lambda scope: convert_value(compute(scope))


def _items(template: Items, field_type: Any, where: str) -> Build:
    items = [
        _field(item, field_type.value_type, f"{where}[{index}]")
        for index, item in enumerate(template.items)
    ]
    convert_list = _converter(field_type, where)
    return lambda scope: convert_list([build(scope) for build in items])


def _converter(field_type: Any, where: str) -> Convert:
    match field_type:
        case BasicType():
            return _basic_converter(field_type.typename, where)
        case AbstractString() | AbstractWString():
            return _text_converter(field_type, where)
        case NamespacedType():
            return _message_converter(_message_class(field_type), where)
        case AbstractNestedType():
            return _list_converter(field_type, where)
        case _:
            raise MessageError(f"{where} has a type that is not supported: {field_type}")


def _basic_converter(type_name: str, where: str) -> Convert:
    match type_name:
        case "boolean":
            return _exactly(bool, "a boolean", where)
        case "float" | "double" | "long double":
            return lambda value: value if type(value) is float else _float(value, where)
        case "octet":
            return lambda value: _octet(value, where)
        case _:
            low, high = _INTEGER_RANGES[type_name]
            return lambda value: _integer(value, low, high, where)


def _exactly(kind: type, described: str, where: str) -> Convert:
    def convert_value(value: Any) -> Any:
        if not isinstance(value, kind):
            raise MessageError(f"{where} takes {described}, not {_format(value)}")
        return value

    return convert_value


def _float(value: Any, where: str) -> float:
    if isinstance(value, bool) or not hasattr(value, "__float__") or isinstance(value, str):
        raise MessageError(f"{where} takes a number, not {_format(value)}")
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise MessageError(f"{where} takes a number, not {_format(value)}") from error


def _integer(value: Any, low: int, high: int, where: str) -> int:
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise MessageError(f"{where} takes an integer, not {_format(value)}")
    number = int(value)
    if not low <= number <= high:
        raise MessageError(f"{where} takes an integer from {low} to {high}, not {number}")
    return number


def _octet(value: Any, where: str) -> bytes:
    if isinstance(value, bytes) and len(value) == 1:
        return value
    return bytes([_integer(value, 0, 255, where)])


def _text_converter(field_type: Any, where: str) -> Convert:
    if not isinstance(field_type, BoundedString):
        return _exactly(str, "a string", where)

    def convert_value(value: Any) -> str:
        if not isinstance(value, str) or len(value) > field_type.maximum_size:
            expected = f"a string of up to {field_type.maximum_size} characters"
            raise MessageError(f"{where} takes {expected}, not {_format(value)}")
        return value

    return convert_value


def _message_converter(message_type: Any, where: str) -> Convert:
    name = _type_name(message_type)

    def convert_value(value: Any) -> Any:
        if isinstance(value, message_type):
            return value
        if isinstance(value, Mapping):
            return convert_message(value, message_type, where)
        if name in _SECONDS_TYPES and isinstance(value, (int, float)):
            return _from_seconds(value, message_type, where)
        raise MessageError(f"{where} takes a {name}, not {_format(value)}")

    return convert_value


def _from_seconds(value: float, message_type: Any, where: str) -> Any:
    try:
        seconds, nanoseconds = divmod(round(value * _NANOSECONDS), _NANOSECONDS)
    except (ValueError, OverflowError) as error:
        raise MessageError(f"{where} takes seconds, not {_format(value)}") from error
    low, high = _INTEGER_RANGES["int32"]
    if isinstance(value, bool) or not low <= seconds <= high:
        raise MessageError(f"{where} takes seconds from {low} to {high}, not {_format(value)}")
    return message_type(sec=seconds, nanosec=nanoseconds)


def _list_converter(field_type: Any, where: str) -> Convert:
    convert_item = _converter(field_type.value_type, f"an item of {where}")

    typecode = _TYPECODES.get(getattr(field_type.value_type, "typename", ""))
    of_any_length = isinstance(field_type, UnboundedSequence)

    def convert_value(value: Any) -> Any:
        if of_any_length and isinstance(value, array) and value.typecode == typecode:
            return value  # do not check the data of an image byte by byte
        if isinstance(value, (str, Mapping)) or not hasattr(value, "__iter__"):
            raise MessageError(f"{where} takes a list, not {_format(value)}")
        items = [convert_item(item) for item in value]
        if isinstance(field_type, Array) and len(items) != field_type.size:
            raise MessageError(f"{where} takes {field_type.size} items, not {len(items)}")
        if isinstance(field_type, BoundedSequence) and len(items) > field_type.maximum_size:
            limit = field_type.maximum_size
            raise MessageError(f"{where} takes up to {limit} items, not {len(items)}")
        return items

    return convert_value


def _field_types(message_type: Any) -> dict[str, Any]:
    return dict(
        zip(message_type.get_fields_and_field_types(), message_type.SLOT_TYPES, strict=True)
    )


def _no_field(where: str, message_type: Any, name: str) -> MessageError:
    known = message_type.get_fields_and_field_types()
    text = f"{where}: {_type_name(message_type)} has no field '{name}'"
    return MessageError(text, suggestion(name, known))


def _message_class(field_type: NamespacedType) -> Any:
    return interface_class("/".join(field_type.namespaced_name()))


def _type_name(message_type: Any) -> str:
    package = message_type.__module__.partition(".")[0]
    return f"{package}/{message_type.__name__}"


def _field_path(where: str, name: str) -> str:
    """Return the path of a field of ``where``, a message or one of its fields."""
    return f"{where} field {name}" if where.endswith("'") else f"{where}.{name}"


def _kind_of(field_type: Any) -> str:
    match field_type:
        case BasicType():
            return f"a {field_type.typename}"
        case AbstractString() | AbstractWString():
            return "a string"
        case NamespacedType():
            return f"a {field_type.namespaces[0]}/{field_type.name}"
        case _:
            return "a list"


def _format(value: Any) -> str:
    text = repr(value)
    return f"{type(value).__name__} {text if len(text) <= 80 else text[:77] + '...'}"
