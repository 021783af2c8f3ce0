"""The classes that the type checker names: generated ones, messages, and the API for behaviors."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from functools import cached_property

from composer import behavior
from composer.diagnostics import nearest, suggestion
from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces, Message
from composer.interfaces.definitions import parts
from composer.interfaces.sources import FOLDERS
from composer.model import Node
from composer.python_code.problems import Family
from composer.python_code.stubs.messages import short_type
from composer.python_code.stubs.behaviors import PORT_ATTRIBUTES, member_class_name

#: Names of ROS 1 and of other libraries, with what ROS 2 has instead.
_OTHER_NAMES = {"nsec": "nanosec", "nsecs": "nanosec", "secs": "sec"}


@dataclass(frozen=True, slots=True)
class Owner:
    """What an attribute belongs to: how messages name it, and the attributes that it has."""

    family: Family
    name: str
    what: str  # of its attributes: "publisher", "field", ...
    members: tuple[str, ...]

    def lacks(self, name: str) -> str:
        """Return the message about an attribute that it does not have."""
        return f"{self.name} has no {self.what} '{name}'"

    def hint(self, name: str) -> str | None:
        """Return the attribute that was meant."""
        other = _OTHER_NAMES.get(name)
        if other in self.members:
            return f"did you mean '{other}'?"
        if self.what == "attribute":
            close = nearest(name, self.members)
            return f"did you mean '{close}'?" if close is not None else None
        return suggestion(name, self.members)


class Owners:
    """Looks up the classes that a check may name."""

    def __init__(self, behaviors: Mapping[str, Node], interfaces: Interfaces) -> None:
        self.interfaces = interfaces
        self._behaviors = behaviors

    def named(self, name: str, *, with_api: bool) -> Owner | None:
        """Return the owner with the short name of a class, None for classes of others.

        Names of the API for behaviors are also names of rclpy.
        """
        if name in self._groups:
            return self._groups[name]
        if name in self._messages:
            return self.message(self._messages[name])
        api = getattr(behavior, name, None) if with_api else None
        if inspect.isclass(api) and api.__module__ == behavior.__name__:
            names = tuple(item for item in dir(api) if not item.startswith("_"))
            return Owner(Family.PORT, f"{name} of composer.behavior", "attribute", names)
        return None

    @cached_property
    def attributes(self) -> frozenset[str]:
        """The attributes that the composer sets."""
        return frozenset(name for name in behavior.Behavior.__slots__ if name[0] != "_")

    @cached_property
    def exceptions(self) -> frozenset[str]:
        """The names that behaviors may import from ``composer.behavior``."""
        return frozenset(
            name
            for name, item in vars(behavior).items()
            if inspect.isclass(item) and item.__module__ == behavior.__name__
        )

    def message(self, name: str) -> Owner | None:
        """Return a message, or a part of a service or action, by its full name."""
        definition = self._definition(name)
        if definition is None:
            return None
        constants = (constant.name for constant in definition.constants)
        members = (*definition.field_names, *constants)
        return Owner(Family.FIELD, name, "field", members)

    def field_type(self, interface: str, name: str) -> str | None:
        """Return the type of a field as definitions write it, None if it is not known."""
        definition = self._definition(interface)
        found = definition.field(name) if definition is not None else None
        return str(found.type) if found is not None else None

    def with_field(self, name: str, expected: str) -> str | None:
        """Return a message that has a field of this name and type."""
        for full in self._messages.values():
            definition = self._definition(full)
            found = definition.field(name) if definition is not None else None
            if found is not None and short_type(found.type) == expected.rpartition(".")[2]:
                return full
        return None

    def interface(self, text: str) -> str:
        """Return how messages name a type: an interface by its full name."""
        plain = text.removeprefix("type[").removesuffix("]")
        full = self._messages.get(plain)
        if full is None:
            return text
        return f"the class {full}" if text.startswith("type[") else full

    def _definition(self, name: str) -> Message | None:
        """Return a message by its full name, or the part ``package/srv/Name_Request``."""
        found = self.interfaces.message(name)
        base, _, part = name.rpartition("_")
        whole = self.interfaces.find(base) if found is None and base else None
        return found if whole is None else parts(whole).get(part.lower())

    @cached_property
    def _groups(self) -> dict[str, Owner]:
        """The generated classes with ports and parameters."""
        groups = {}
        for base, node in self._behaviors.items():
            for attribute, kind in PORT_ATTRIBUTES.items():
                names = _names(port.name.value for port in node.ports_of(kind))
                owner = Owner(Family.PORT, f"node '{node.name}'", kind.value, names)
                groups[member_class_name(base, attribute)] = owner
            names = _names(parameter.name.value for parameter in node.parameters)
            owner = Owner(Family.PORT, f"node '{node.name}'", "parameter", names)
            groups[member_class_name(base, "parameters")] = owner
        return groups

    @cached_property
    def _messages(self) -> dict[str, str]:
        """The full names of messages and parts, by the names of their classes."""
        found: dict[str, str] = {}
        for folder in FOLDERS:
            for name in self.interfaces.names(folder):
                short = name.rpartition("/")[2]
                if folder == "msg":
                    found.setdefault(short, name)
                    continue
                names = ("Request", "Response") if folder == "srv" else ("Goal", "Result", "Feedback")
                found.update((f"{short}_{part}", f"{name}_{part}") for part in names)
        return found


def _names(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(name for name in names if name.isidentifier())
