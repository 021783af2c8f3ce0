"""The classes that the type checker names, and imports that fail: misspelled, or not installed."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.base.spelling import edit_distance
from composer.interfaces import Interfaces
from composer.interfaces.sources import FOLDERS
from composer.project import Project
from composer.python_code.lookup import BehaviorSource
from composer.python_code.modules import module_below, module_origin, nearby_modules
from composer.python_code.nodes import API_NAMES
from composer.python_code.problems import Family, Problem
from composer.python_code.stubs.folder import LIBRARIES
from composer.python_code.syntax import Module, defined_names

#: Packages that users often import. Where files are validated, they may be missing.
_USUAL = frozenset(
    {"ament_index_python", "composer", "cv2", "cv_bridge", "launch", "launch_ros", "numpy"}
    | {"message_filters", "rclpy", "sensor_msgs_py", "tf2_geometry_msgs", "tf2_py", "tf2_ros"}
    | {"tf2_sensor_msgs", "tf_transformations"}
)
#: With these, a file gets modules that the current search path does not show.
_AT_RUN_TIME = ("sys.path", "import_module", "importlib.util", "addsitedir", "__import__")
_LONG_NAME = 8  # letters, of which two may be wrong
#: Names of ROS 1, with what ROS 2 has instead.
_ROS_1_NAMES = {"nsec": "nanosec", "nsecs": "nanosec", "secs": "sec"}
#: The module with the classes of ``self.publishers`` and the like. They have no base class.
_GENERATED = "composer.typed"
#: A class in a stub, and the names in its body.
_CLASS = re.compile(r"^class (\w+)(?:\(_ros.*|:)\n((?: .*\n)*)", re.MULTILINE)
_MEMBER = re.compile(r"^    (?:def )?(?!def )([A-Za-z]\w*)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Imports:
    """The imports of one file of a behavior or class. Relative names begin with their dots.

    ``span`` is where the type checker reports an import that fails.
    """

    span: Span
    module: Module
    source: BehaviorSource
    interfaces: Interfaces

    def missing_module(self, name: str, wanted: str) -> Problem | None:
        """Return why a module cannot be imported; None if it exists, but not as Python source.

        ``wanted`` is the name to import from it, or "".
        """
        relative = name.lstrip(".")
        is_absolute = relative == name
        top, _, rest = relative.partition(".")
        packages = self.interfaces.packages() if is_absolute else ()
        if top in packages and rest.partition(".")[0] in FOLDERS:  # maybe a private module
            return self.missing_name(name, wanted) if rest in FOLDERS and wanted else None
        if any(module_below(base, relative.split(".")) for base in self._folders(name)):
            return None
        if is_absolute and _is_installed(name):
            return None
        if top in sys.stdlib_module_names and is_absolute:
            return self._failed(rest or top, f"no module named '{name}'")
        nearby = nearby_modules(relative, self._folders(name))
        if rest and nearby.missing in packages:  # only its definitions are here, as without ROS
            nearby = replace(nearby, package=top, missing=rest.partition(".")[0])
        names = {*nearby.names}
        if nearby.package in packages:
            names.update(FOLDERS)
        elif not nearby.package and is_absolute:
            names.update(_USUAL, packages)
        path = f"{nearby.package}.{nearby.missing}".lstrip(".")
        message = f"no module named '{name.removesuffix(relative)}{path}'"
        return self._misspelled(nearby.missing, message, names, " is installed")

    def missing_name(self, module: str, name: str) -> Problem | None:
        """Return why a name cannot be imported from a module; None if that is not known."""
        message = f"module '{module}' has no '{name}'"
        package, _, folder = module.partition(".")
        if package in self.interfaces.packages() and folder in ("", *FOLDERS):
            prefix = f"{package}/{folder}/"
            listed = self.interfaces.names(folder) if folder else ()
            others = [item.removeprefix(prefix) for item in listed if item.startswith(prefix)]
            home = self._home(package, folder, name)
            if name in others or not (folder or home):
                return None  # its definition cannot be read, or it may be another module
            hint = suggestion(name, others) if home is None else f"import it from '{home}'"
            return self._failed(name, message, hint)
        last = module.rpartition(".")[2]
        own = self.source.own_modules
        files = [item for item in own if last in (item.path.stem, item.path.parent.name)]
        if (last and not files) or any(item.dynamic for item in files):
            return None
        names = {other for item in files for other in defined_names(item)}
        if any(item.path.stem == last for item in files):
            return self._failed(name, message, suggestion(name, names))
        nearby = nearby_modules(f"{module.lstrip('.')}.{name}".lstrip("."), self._folders(module))
        return self._misspelled(name, message, names.union(nearby.names))

    def _folders(self, name: str) -> list[Path]:
        """Return the folders in which a module is looked for."""
        level = len(name) - len(name.lstrip("."))
        if level:
            return [*self.module.path.parents[level - 1 : level]]
        reference = self.source.reference
        homes = (self.module.path.parent, reference.folder)
        return [*homes, *reference.node_folders, LIBRARIES]

    def _home(self, package: str, folder: str, name: str) -> str | None:
        """Return the only module that has an interface: in a package, or any."""
        listed = (item.split("/") for item in self.interfaces.names())
        homes = [item[:2] for item in listed if item[2] == name]
        own = [home for home in homes if home[0] == package]
        homes = own or [home for home in homes if home[1] == folder]
        return ".".join(homes[0]) if len(homes) == 1 else None

    def _misspelled(
        self, name: str, message: str, names: Iterable[str], where: str = ""
    ) -> Problem | None:
        """Return the problem of a name: an error if another one was meant, else an info.

        ``where`` ends the message of an info.
        """
        limit = 2 if len(name) >= _LONG_NAME else 1
        near = [(edit_distance(name, other), other) for other in names if other[:1] == name[:1]]
        distance, close = min(near, default=(limit + 1, ""))
        if distance == 0:
            return None  # it exists, but the checker cannot read it
        if distance <= limit:
            return self._failed(name, message, f"did you mean '{close}'?")
        hint = "install it, or correct the name"
        return self._failed(name, f"{message}{where}", hint, Family.NOT_INSTALLED)

    def _failed(
        self, part: str, message: str, hint: str | None = None, family: Family = Family.IMPORT
    ) -> Problem:
        """Return the problem of a part of the name; an info if the file searches for modules."""
        if any(text in self.module.source.text for text in _AT_RUN_TIME):
            hint, family = "the file searches for modules itself", Family.NOT_INSTALLED
        place = re.search(rf"\b{re.escape(part)}\b", self.span.text)
        span = self.span.part(place.start() if place else 0, len(part))
        return Problem(family, message, span, hint)


def _is_installed(name: str) -> bool:
    """Return whether a module outside of the project exists."""
    home = Path(__file__).parent
    return module_origin(name, home, Project.at(home)) is not None


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
