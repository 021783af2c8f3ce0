"""The message classes of a test: from ROS where it is installed, plain classes elsewhere.

A plain class has the fields, defaults and constants of the definition: so a behavior that imports
no message package needs no ROS.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from math import inf
from types import SimpleNamespace
from typing import Any, cast

from composer.interfaces import (
    FLOATS,
    INTEGER_RANGES,
    TEXTS,
    FieldType,
    Interface,
    Interfaces,
    Message,
    parts,
    split_name,
)
from composer.testing.failures import TestFailure, short, unknown

#: The Python types of values, except for integers.
_TYPES: Mapping[str, type] = {
    "bool": bool,
    "byte": bytes,
    **dict.fromkeys(FLOATS, float),
    **dict.fromkeys(TEXTS, str),
}


class MessageClasses:
    """The classes of the interfaces that a project may use."""

    def __init__(self, interfaces: Interfaces) -> None:
        self._interfaces = interfaces
        self._plain: dict[str, Any] = {}

    def interface(self, name: str) -> Any:
        """Return the class of a message, service or action. Raises TestFailure if none is known."""
        definition = self._interfaces.find(name)
        names = split_name(name)
        if definition is None or names is None:
            raise TestFailure(f"interface '{name}' is not known")
        try:
            return getattr(import_module(f"{names[0]}.{names[1]}"), names[2])
        except (ImportError, AttributeError):
            if name not in self._plain:
                self._plain[name] = self._plain_class(definition)
            return self._plain[name]

    def make(self, interface: str, part: str, content: Any, where: str) -> Any:
        """Return ``content`` as the ``part`` of an interface, such as ``message`` or ``request``.

        ``content`` is such a message, a mapping with values of some fields, or None for the
        defaults. Raises TestFailure for anything else; ``where`` names it.
        """
        kind, definition = self._part(interface, part)
        if content is None:
            return kind()
        if isinstance(content, Mapping):
            content = self._filled(kind(), definition, content, where)
        self.check(interface, part, content, where)
        return content

    def check(self, interface: str, part: str, content: Any, where: str) -> None:
        """Raise TestFailure if ``content`` is no ``part`` of the interface, or a value is wrong.

        Classes of ROS do not check values: a wrong one fails, or changes, when it is sent.
        """
        kind, definition = self._part(interface, part)
        if not isinstance(content, kind):
            raise TestFailure(f"{where} takes a {kind.__name__}, not {short(repr(content))}")
        for field in definition.fields:
            self._check(field.type, getattr(content, field.name), f"{where}.{field.name}")

    def _part(self, interface: str, part: str) -> tuple[Any, Message]:
        kind = self.interface(interface)
        definition = parts(cast(Interface, self._interfaces.find(interface)))[part]
        return (kind if part == "message" else getattr(kind, part.capitalize())), definition

    def _filled(
        self, message: Any, definition: Message, values: Mapping[str, Any], where: str
    ) -> Any:
        for name, value in values.items():
            field = definition.field(name)
            if field is None:
                text = f"{where}: {definition.name} has no field '{name}'"
                raise unknown(text, name, definition.field_names)
            made = self._value(field.type, value, f"{where}.{name}")
            self._check(field.type, made, f"{where}.{name}")
            setattr(message, name, made)
        return message

    def _value(self, kind: FieldType, value: Any, where: str) -> Any:
        if kind.is_array and isinstance(value, list | tuple):
            return [
                self._value(kind.element, item, f"{where}[{i}]") for i, item in enumerate(value)
            ]
        if isinstance(value, Mapping) and not kind.is_primitive and not kind.is_array:
            return self.make(kind.name, "message", value, where)
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        return float(value) if is_whole and kind.name in FLOATS else value

    def _check(self, kind: FieldType, value: Any, where: str) -> None:
        if kind.is_array and hasattr(value, "__len__") and not isinstance(value, str):
            least = kind.array_size or 0
            most = kind.array_size or (inf if kind.array_bound is None else kind.array_bound)
            is_right = least <= len(value) <= most
            if isinstance(value, list | tuple):  # arrays of numbers have a type of their own
                for index, item in enumerate(value):
                    self._check(kind.element, item, f"{where}[{index}]")
        elif not kind.is_primitive and not kind.is_array:
            self.check(kind.name, "message", value, where)
            is_right = True
        elif kind.name in INTEGER_RANGES and isinstance(value, int):
            low, high = INTEGER_RANGES[kind.name]
            is_right = low <= value <= high
        else:
            is_right = isinstance(value, _TYPES.get(kind.name, ())) and not kind.is_array
        if not is_right:
            raise TestFailure(f"{where} takes a {kind}, not {short(repr(value))}")

    # --- plain classes

    def _plain_class(self, definition: Any) -> Any:
        if isinstance(definition, Message):
            return self._message_class(definition)
        classes = {
            part.capitalize(): self._message_class(message)
            for part, message in parts(definition).items()
        }
        return type(definition.name.rpartition("/")[2], (), classes)

    def _message_class(self, definition: Message) -> type[Any]:
        initial = self._initial

        class Plain(SimpleNamespace):  # which compares and shows its fields
            def __init__(self, **values: Any) -> None:
                fields = definition.fields
                super().__init__(**{item.name: initial(item.type, item.default) for item in fields})
                for name, value in values.items():
                    setattr(self, name, value)

            def __setattr__(self, name: str, value: Any) -> None:
                if definition.field(name) is None:
                    raise AttributeError(f"{definition.name} has no field '{name}'")
                super().__setattr__(name, value)

        for constant in definition.constants:
            setattr(Plain, constant.name, constant.value)
        Plain.__name__ = Plain.__qualname__ = definition.name.rpartition("/")[2]
        return Plain

    def _initial(self, kind: FieldType, default: Any) -> Any:
        if default is not None:
            return list(default) if isinstance(default, list) else default
        if kind.is_array:
            return [self._initial(kind.element, None) for _ in range(kind.array_size or 0)]
        if not kind.is_primitive:
            return self.interface(kind.name)()
        return b"\x00" if kind.name == "byte" else _TYPES.get(kind.name, int)()
