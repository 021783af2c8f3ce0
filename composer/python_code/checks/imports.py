"""Checks imports: modules that are missing or misspelled, and names that a module does not have."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from composer.base.diagnostics import suggestion
from composer.base.source import shown_path
from composer.base.spelling import edit_distance
from composer.interfaces import Interfaces
from composer.interfaces.sources import FOLDERS
from composer.project import Project
from composer.python_code.modules import (
    COMPILED,
    Unreadable,
    files_and_folders,
    is_installed,
    local_module_file,
    module_file,
    relative_module_file,
)
from composer.python_code.nodes import API_CLASSES
from composer.python_code.problems import Family, Problem
from composer.python_code.stubs.folder import LIBRARIES
from composer.python_code.syntax import Module, defined_names, read_module
from composer.python_code.trees import dotted, start_span, walk

_API = "composer.behavior"
_API_NAMES = API_CLASSES | {"Any", "Changes"}
#: Packages that users often import. Where files are validated, they may be missing.
_USUAL = frozenset(
    {"ament_index_python", "composer", "cv2", "cv_bridge", "launch", "launch_ros", "numpy"}
    | {"message_filters", "rclpy", "sensor_msgs_py", "tf2_geometry_msgs", "tf2_py", "tf2_ros"}
    | {"tf2_sensor_msgs", "tf_transformations"}
)
#: With these, a file gets modules that the current search path does not show.
_AT_RUN_TIME = frozenset(
    {"sys.path", "importlib.import_module", "importlib.util", "site.addsitedir", "__import__"}
)
_LONG_NAME = 8  # letters, of which two may be wrong
_SHORTEST_TYPO = 4


class _Contents(NamedTuple):
    """The names in a module; unless ``is_closed``, it may have others where the code runs."""

    names: frozenset[str]
    is_closed: bool


class _Missing(NamedTuple):
    """What cannot be imported."""

    message: str
    hint: str | None = None
    family: Family = Family.IMPORT


def import_problems(module: Module, folder: Path, interfaces: Interfaces) -> Iterator[Problem]:
    """Yield the problems of the imports in a file.

    ``folder`` has the YAML file. Imports in an ``if``, a ``try`` or a ``with`` may fail, so
    they are left out. A missing module is only an error if its name is a typo: it may be installed
    or generated where the code runs.
    """
    imports = _Imports(module, folder, interfaces)
    for node in walk(module.tree.body, closed=(ast.If, ast.Match, ast.Try, ast.With)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                for part, missing in imports.missing_modules(alias.name):
                    yield imports.problem(missing, alias, alias.name, part)
        elif isinstance(node, ast.ImportFrom):
            name = "." * node.level + (node.module or "")
            for part, missing in imports.missing_modules(name):
                yield imports.problem(missing, node, f"from {name}", part)
                break
            else:
                lacking = [alias for alias in node.names if imports.lacks(name, alias.name)]
                for alias in lacking[:1]:  # the others have the same cause
                    missing = imports.missing_names(name, [item.name for item in lacking])
                    yield imports.problem(missing, alias, alias.name, alias.name)


class _Imports:
    """Looks up what the imports of a file name."""

    def __init__(self, module: Module, folder: Path, interfaces: Interfaces) -> None:
        self.module = module
        self.interfaces = interfaces
        homes = dict.fromkeys((module.path.parent, folder))
        self._projects = {home: Project.at(home) for home in homes}
        self._contents = cache(self._read_contents)

    def missing_modules(self, name: str) -> Iterator[tuple[str, _Missing]]:
        """Yield why a module cannot be imported, or should not be, with the part of its name."""
        top, _, rest = name.partition(".")
        if rest and top in sys.stdlib_module_names and is_installed(top) and not _has_file(name):
            yield rest, _Missing(f"no module named '{name}'")
        dots = name[: len(name) - len(name.lstrip("."))]
        parts = name.removeprefix(dots).split(".") if name != dots else ()
        for count, part in enumerate(parts):
            package, path = (dots + ".".join(parts[:end]) for end in (count, count + 1))
            contents = self._contents(package)
            if contents is None or (not package and part in sys.stdlib_module_names):
                return
            if part in contents.names:
                continue
            if package == "composer" and _has_file(path):
                message = f"'{path}' is internal to the composer and may change without notice"
                hint = f"behaviors import from '{_API}' only"
                yield path, _Missing(message, hint, family=Family.INTERNAL)
            elif dots or not (_has_file(path) if package else is_installed(part)):
                message = f"no module named '{path}'"
                yield part, _missing(message, part, contents.names, " is installed")
            return

    def missing_names(self, module: str, names: Sequence[str]) -> _Missing:
        """Return the problem of names that are not in a module."""
        message = f"module '{module}' has no {' and '.join(map(repr, names))}"
        home = self._home(module, names)
        if home is not None:
            them = "it" if len(names) == 1 else "them"
            return _Missing(message, f"import {them} from '{home}'")
        known, is_closed = self._contents(module) or _Contents(frozenset(), is_closed=True)
        if not is_closed:
            return _missing(message, names[0], known)
        hint = suggestion(names[0], known) if len(names) == 1 else None
        return _Missing(message, hint)

    def lacks(self, module: str, name: str) -> bool:
        """Return whether a module has no such name, as far as is known.

        The type checker knows the names in rclpy.
        """
        if module == "rclpy" or self.interfaces.find(f"{module.replace('.', '/')}/{name}"):
            return False
        contents = self._contents(module)
        if contents is None or name == "*" or name.startswith("__") or name in contents.names:
            return False
        if module in self.interfaces.packages():
            return self._home(module, [name]) is not None  # else it may be another module
        if module.partition(".")[0] in self.interfaces.packages():
            # Python also has Trigger_Request, and private modules.
            return not name.startswith("_") and name.partition("_")[0] not in contents.names
        return not _has_file(f"{module}.{name}")

    def _read_contents(self, module: str) -> _Contents | None:
        """Return what a module contains; None if that is not known."""
        package, _, folder = module.partition(".")
        if package == "composer":
            names = _API_NAMES if module == _API else frozenset({"behavior", "typed"})
            is_known = folder in ("", "behavior")
            return _Contents(names, is_closed=module == _API) if is_known else None
        try:
            own = self._read_own(module)
        except Unreadable:
            return None
        if own is None and module == "rclpy":
            stubs = (path.stem for path in (LIBRARIES / module).iterdir())
            return _Contents(frozenset(stubs), is_closed=False)
        packages = frozenset(self.interfaces.packages())
        if not module:
            names = own.names if own is not None else frozenset()
            return _Contents(names | _USUAL | packages, is_closed=False)
        if own is not None and module in packages:
            return _Contents(own.names.union(FOLDERS), is_closed=False)
        if own is not None or package not in packages or folder not in ("", *FOLDERS):
            return own
        prefix = f"{package}/{folder}/"
        listed = self.interfaces.names(folder) if folder else ()
        interfaces = {name.removeprefix(prefix) for name in listed if name.startswith(prefix)}
        known = frozenset(interfaces) if folder else frozenset(FOLDERS)
        return _Contents(known, is_closed=bool(folder))

    def _read_own(self, module: str) -> _Contents | None:
        """Return what a module of the project contains. Raises Unreadable."""
        name = module.lstrip(".")
        level = len(module) - len(name)
        others = (path for project in self._projects.values() for path in project.node_folders)
        folders = [*dict.fromkeys((*self._projects, *others))]
        file = None
        if level:
            folders = [*self.module.path.parents[level - 1 : level]]
            file = relative_module_file(name, level, self.module.path)
        elif name:
            files = (local_module_file(name, *place) for place in self._projects.items())
            file = next(filter(None, files), None)
        defined = frozenset[str]()
        if file is not None:
            own = read_module(file, shown_path(file))
            defined, folders = defined_names(own), [file.parent]
            if own.dynamic or file.stem != "__init__":
                return None if own.dynamic else _Contents(defined, is_closed=True)
        elif name:
            return None
        listed = [name for folder in folders for name in files_and_folders(folder)]
        if module and any(Path(name).suffix in COMPILED for name in listed):
            return None
        return _Contents(defined.union(Path(name).stem for name in listed), is_closed=False)

    def _home(self, module: str, names: Sequence[str]) -> str | None:
        """Return the only module that has all these interfaces: in the same package, or any."""
        package, _, folder = module.partition(".")
        packages = self.interfaces.packages()
        own = [f"{package}.{part}" for part in sorted(FOLDERS)]
        others = [f"{other}.{folder}" for other in packages if folder in FOLDERS]
        for modules in (own, others) if package in packages else ():
            paths = {home: home.replace(".", "/") for home in modules}
            found = [
                home
                for home, path in paths.items()
                if all(self.interfaces.find(f"{path}/{name}") is not None for name in names)
            ]
            if found:
                return found[0] if len(found) == 1 else None
        return None

    def problem(
        self, missing: _Missing, node: ast.alias | ast.ImportFrom, text: str, part: str
    ) -> Problem:
        """Return the problem of a part of an import, which begins with a text.

        It is not an error in a file that searches for modules itself.
        """
        family, hint = missing.family, missing.hint
        nodes = walk(self.module.tree.body)
        used = {dotted(item) for item in nodes if isinstance(item, ast.Attribute | ast.Name)}
        if family is Family.IMPORT and used & _AT_RUN_TIME:
            family, hint = Family.NOT_INSTALLED, "the file searches for modules itself"
        span = start_span(node, len(text), self.module.source)
        return Problem(family, missing.message, span.part(text.rfind(part), len(part)), hint)


def _missing(message: str, name: str, known: Iterable[str], where: str = "") -> _Missing:
    """Return the problem of a name: an error if another one was meant, else an info.

    ``where`` ends the message of an info.
    """
    limit = 2 if len(name) >= _LONG_NAME else 1
    near = [(edit_distance(name, other), other) for other in known if other[:1] == name[:1]]
    distance, close = min(near, default=(limit + 1, ""))
    if distance <= limit:
        return _Missing(message, f"did you mean '{close}'?")
    hint = "install it, or correct the name"
    for other in sys.stdlib_module_names:
        is_public = len(other) >= _SHORTEST_TYPO and other[0] != "_"
        if is_public and other[:2] == name[:2] and edit_distance(name, other) == 1:
            hint = f"did you mean '{other}'?"
    return _Missing(f"{message}{where}", hint, Family.NOT_INSTALLED)


def _has_file(name: str) -> bool:
    """Return whether a module outside of the project exists."""
    home = Path(__file__).parent
    return name in sys.modules or module_file(name, home, Project.at(home)) is not None
