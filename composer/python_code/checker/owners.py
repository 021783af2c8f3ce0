"""The classes that the type checker names: generated ones, messages, and the API for behaviors."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cached_property

from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.python_code.nodes import API_NAMES
from composer.python_code.problems import Family
from composer.python_code.syntax import Module

#: Names of ROS 1, with what ROS 2 has instead.
_ROS_1_NAMES = {"nsec": "nanosec", "nsecs": "nanosec", "secs": "sec"}
#: The module with the classes of ``self.publishers`` and the like. They have no base class.
_GENERATED = "composer.typed"
#: A class in a stub, and the names in its body.
_CLASS = re.compile(r"^class (\w+)(?:\(_ros.*|:)\n((?: .*\n)*)", re.MULTILINE)
_MEMBER = re.compile(r"^    (?:def )?(?!def )([A-Za-z]\w*)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Owner:
    """What an attribute belongs to: its family, and the attributes that it has."""

    family: Family
    members: tuple[str, ...]

    def hint(self, name: str) -> str | None:
        """Return the attribute that was meant by a wrong one."""
        other = _ROS_1_NAMES.get(name, "")
        if other in self.members:
            return f"did you mean '{other}'?"
        return suggestion(name, self.members)


class Owners:
    """Looks up the classes in the stubs of a check."""

    def __init__(self, stubs: Mapping[str, str]) -> None:
        self._stubs = stubs

    def named(self, name: str, module: Module, *, with_api: bool) -> Owner | None:
        """Return the owner with the short name of a class, None for classes of others.

        rclpy and the API for behaviors have classes with the names of messages.
        """
        homes = self.members.get(name, {})
        if _GENERATED in homes:
            return Owner(Family.PORT, homes[_GENERATED])
        is_of_api = with_api and name in API_NAMES
        is_ambiguous = is_of_api or name == "Parameter"
        imported = module.imports.get(name)
        members = homes.get(imported.module) if imported is not None else None
        if members is None and not is_ambiguous:
            members = next(iter(homes.values()), None)
        if members is not None:
            return Owner(Family.FIELD, members)
        return Owner(Family.PORT, API_NAMES[name]) if is_of_api else None

    @cached_property
    def members(self) -> dict[str, dict[str, tuple[str, ...]]]:
        """The attributes of messages, ports and parameters, by their class and its module."""
        found: dict[str, dict[str, tuple[str, ...]]] = {}
        for path, text in self._stubs.items():
            home = ".".join(path.removesuffix(".pyi").split("/")[-2:])
            for name, body in _CLASS.findall(text) if home != "composer.behavior" else ():
                found.setdefault(name, {})[home] = tuple(dict.fromkeys(_MEMBER.findall(body)))
        return found
