"""The classes that the type checker names: generated ones, messages, and the API for behaviors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from functools import cached_property

from composer import behavior
from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.interfaces.definitions import parts
from composer.interfaces.sources import FOLDERS
from composer.model import Node
from composer.python_code.nodes import API_CLASSES
from composer.python_code.problems import Family
from composer.python_code.stubs.behaviors import PORT_ATTRIBUTES, member_class_name
from composer.python_code.syntax import Module

#: Names of ROS 1, with what ROS 2 has instead.
_ROS_1_NAMES = {"nsec": "nanosec", "nsecs": "nanosec", "secs": "sec"}
_PARTS = {"msg": (), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}


@dataclass(frozen=True, slots=True)
class Owner:
    """What an attribute belongs to: its family, and the attributes that it has."""

    family: Family
    members: tuple[str, ...]
    elsewhere: Mapping[str, str] = field(default_factory=dict)  # of the node: name to attribute
    is_api: bool = False  # has too many attributes for a hint to list

    def hint(self, name: str) -> str | None:
        """Return the attribute that was meant by a wrong one."""
        other = _ROS_1_NAMES.get(name, "")
        if other in self.members:
            return f"did you mean '{other}'?"
        if name in self.elsewhere:
            return f"'{name}' is in '{self.elsewhere[name]}'"
        return suggestion(name, self.members, limit=0 if self.is_api else 8)


class Owners:
    """Looks up the classes that a check may name."""

    def __init__(self, behaviors: Mapping[str, Node], interfaces: Interfaces) -> None:
        self.interfaces = interfaces
        self._behaviors = behaviors

    def named(self, name: str, module: Module, *, with_api: bool) -> Owner | None:
        """Return the owner with the short name of a class, None for classes of others.

        Names of the API for behaviors are also names of rclpy, and ``Clock`` is one of a message.
        A message is looked for first in the packages that the module or a port uses.
        """
        if name in self._groups:
            return self._groups[name]
        is_of_api = with_api and name in API_CLASSES
        used = self._used_packages(module)
        known = self.messages.get(name, ())
        full_names = sorted(known, key=lambda full: _package(full) not in used)
        imported = module.imports.get(name)
        is_of_rclpy = name == "Parameter" and (imported is None or imported.module[:5] == "rclpy")
        is_message = bool(full_names) and not is_of_rclpy
        if is_message and (_package(full_names[0]) in used or not is_of_api):
            return self.message(full_names[0])
        return Owner(Family.PORT, public_names(name), is_api=True) if is_of_api else None

    def message(self, name: str) -> Owner | None:
        """Return a message, or a part of a service or action, by its full name."""
        definition = self.interfaces.message(name)
        base, _, part = name.rpartition("_")
        whole = self.interfaces.find(base) if definition is None and base else None
        if whole is not None:
            definition = parts(whole).get(part.lower())
        if definition is None:
            members = _PARTS[name.split("/")[1]]
            return Owner(Family.FIELD, members) if members else None
        constants = (constant.name for constant in definition.constants)
        return Owner(Family.FIELD, (*definition.field_names, *constants))

    def _used_packages(self, module: Module) -> set[str]:
        """Return the packages that the module imports or that types of ports belong to."""
        ports = (port for node in self._behaviors.values() for port in node.ports)
        imported = {item.module.partition(".")[0] for item in module.imports.values()}
        return imported | {_package(port.interface.value) for port in ports}

    @cached_property
    def _groups(self) -> dict[str, Owner]:
        """The generated classes with ports and parameters, by name."""
        groups = {}
        for base, node in self._behaviors.items():
            for attribute, kind in PORT_ATTRIBUTES.items():
                names = (port.name.value for port in node.ports_of(kind))
                groups[member_class_name(base, attribute)] = _group(node, names)
            names = (parameter.name.value for parameter in node.parameters)
            groups[member_class_name(base, "parameters")] = _group(node, names)
        return groups

    @cached_property
    def messages(self) -> dict[str, list[str]]:
        """The full names of messages and of parts, by the names of their classes."""
        found: dict[str, list[str]] = {}
        for folder in FOLDERS:
            for name in self.interfaces.names(folder):
                short = name.rpartition("/")[2]
                found.setdefault(short, []).append(name)
                for part in _PARTS[folder]:
                    found.setdefault(f"{short}_{part}", []).append(f"{name}_{part}")
        return found


def public_names(class_name: str) -> tuple[str, ...]:
    """Return the attributes of a class of the API for behaviors."""
    names = dir(getattr(behavior, class_name))
    return tuple(name for name in names if not name.startswith("_"))


def _package(interface: str) -> str:
    return interface.partition("/")[0]


def _group(node: Node, names: Iterable[str]) -> Owner:
    members = tuple(name for name in names if name.isidentifier())
    elsewhere = {
        port.name.value: attribute
        for attribute, kind in PORT_ATTRIBUTES.items()
        for port in node.ports_of(kind)
    }
    elsewhere |= {item.name.value: "parameters" for item in node.parameters}
    return Owner(Family.PORT, members, elsewhere)
