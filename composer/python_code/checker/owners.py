"""The classes that the type checker names: generated ones, messages, and the API for behaviors."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import field
from functools import cached_property

from composer import behavior
from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.model import Node
from composer.python_code.nodes import API_CLASSES
from composer.python_code.problems import Family
from composer.python_code.stubs.behaviors import PORT_ATTRIBUTES, member_class_name
from composer.python_code.syntax import Module

#: Names of ROS 1, with what ROS 2 has instead.
_ROS_1_NAMES = {"nsec": "nanosec", "nsecs": "nanosec", "secs": "sec"}
#: A class in the stub of a package, and the names in its body.
_CLASS = re.compile(r"^class (\w+)\b.*\n((?: .*\n)*)", re.MULTILINE)
_MEMBER = re.compile(r"^    (?:def )?(?!def )([A-Za-z]\w*)", re.MULTILINE)


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
    """Looks up the classes that a check may name; ``stubs`` has its interfaces."""

    def __init__(self, behaviors: Mapping[str, Node], stubs: Mapping[str, str]) -> None:
        self._behaviors = behaviors
        self._stubs = stubs

    def named(self, name: str, module: Module, *, with_api: bool) -> Owner | None:
        """Return the owner with the short name of a class, None for classes of others.

        rclpy and the API for behaviors have classes with the names of messages.
        """
        if name in self._groups:
            return self._groups[name]
        is_of_api = with_api and name in API_CLASSES
        is_ambiguous = is_of_api or name == "Parameter"
        imported = module.imports.get(name)
        homes = self.messages.get(name, {})
        members = homes.get(imported.module) if imported is not None else None
        if members is None and not is_ambiguous:
            members = next(iter(homes.values()), None)
        if members is not None:
            return Owner(Family.FIELD, members)
        return Owner(Family.PORT, public_names(name), is_api=True) if is_of_api else None

    @cached_property
    def _groups(self) -> dict[str, Owner]:
        """The generated classes with ports and parameters, by name."""
        groups = {}
        for base, node in self._behaviors.items():
            members = {
                attribute: [port.name.value for port in node.ports_of(kind)]
                for attribute, kind in PORT_ATTRIBUTES.items()
            }
            members["parameters"] = [item.name.value for item in node.parameters]
            homes = {name: attribute for attribute, names in members.items() for name in names}
            for attribute, names in members.items():
                known = tuple(filter(str.isidentifier, names))
                groups[member_class_name(base, attribute)] = Owner(Family.PORT, known, homes)
        return groups

    @cached_property
    def messages(self) -> dict[str, dict[str, tuple[str, ...]]]:
        """The members of messages and of parts, by the name of their class and its module."""
        found: dict[str, dict[str, tuple[str, ...]]] = {}
        for path, text in self._stubs.items():
            home = ".".join(path.removesuffix(".pyi").split("/")[-2:])
            for name, body in _CLASS.findall(text) if not home.startswith("composer.") else ():
                found.setdefault(name, {})[home] = tuple(dict.fromkeys(_MEMBER.findall(body)))
        return found


def public_names(class_name: str) -> tuple[str, ...]:
    """Return the attributes of a class of the API for behaviors."""
    names = dir(getattr(behavior, class_name))
    return tuple(name for name in names if not name.startswith("_"))
