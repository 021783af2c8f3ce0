"""Checks imports: modules that are missing or misspelled, and names that a module does not have."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from composer import behavior
from composer.diagnostics import nearest, suggestion
from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.project import Project
from composer.python_code.problems import Family, Problem
from composer.python_code.source import Module, nearby_modules
from composer.python_code.source.method_body import catches, dotted
from composer.python_code.source.modules import (
    Unreadable,
    is_installed,
    module_file,
    relative_module_file,
)
from composer.python_code.source.spans import start_span
from composer.python_code.source.syntax import defined_names, read_module
from composer.python_code.source.traversal import walk
from composer.source import Span, shown_path
from composer.spelling import is_typo
from composer.typed import SUFFIX

_API = "composer.behavior"
_TYPED = "composer.typed"
#: The modules of the API, and the names in them.
_NAMES: Mapping[str, frozenset[str]] = {
    _API: frozenset({"Any", "Changes"}).union(
        name
        for name, item in vars(behavior).items()
        if isinstance(item, type) and item.__module__ == _API
    ),
    _TYPED: frozenset({SUFFIX, "SUFFIX"}),
}
_INTERFACE_FOLDERS = ("msg", "srv", "action")
#: Packages that users often import. They need not be installed where files are validated.
_USUAL = (
    *("ament_index_python", "cv2", "cv_bridge", "launch", "launch_ros", "message_filters"),
    *("numpy", "rclpy", "sensor_msgs_py", "tf2_geometry_msgs", "tf2_py", "tf2_ros"),
    *("tf2_sensor_msgs", "tf_transformations"),
)
_IMPORT_ERRORS = frozenset({"ImportError", "ModuleNotFoundError", "Exception", "BaseException"})
#: With these, a file gets modules that the search path of now does not show.
_AT_RUN_TIME = frozenset(
    {"sys.path", "importlib.import_module", "importlib.util", "site.addsitedir", "__import__"}
)
_MAXIMUM_FILES = 200  # in a folder
#: Fields of statements that contain statements.
_BODIES = ("body", "handlers", "orelse", "finalbody")


@dataclass(frozen=True, slots=True)
class _Missing:
    """What cannot be imported; ``part`` is the misspelled part of the name."""

    message: str
    hint: str | None = None
    part: str = ""
    meant: frozenset[str] = frozenset()
    family: Family = Family.IMPORT


def import_problems(
    module: Module, folder: Path, interfaces: Interfaces
) -> Iterator[tuple[Problem, frozenset[str]]]:
    """Yield the problems of the imports in a file, each with the names that may be meant.

    ``folder`` is that of the YAML file. Imports that need not succeed are left out: alternatives
    under a condition, and those for which the file handles an ImportError.
    """
    imports = _Imports(module, folder, interfaces)
    for node in _unconditional(module.tree.body):
        if isinstance(node, ast.Import):
            for alias in node.names:
                missing = imports.missing_module(alias.name)
                if missing is not None:
                    meant = frozenset() if alias.asname else missing.meant
                    yield _problem(missing, alias.name, alias, module), meant
        elif isinstance(node, ast.ImportFrom):
            name = "." * node.level + (node.module or "")
            missing = imports.missing_module(name)
            if missing is not None:
                yield _problem(missing, name, node, module), frozenset()
                continue
            for lacking, alias in imports.missing_names(name, node):
                yield _problem(lacking, alias.name, alias, module), lacking.meant


@dataclass(frozen=True)
class _Imports:
    module: Module
    folder: Path
    interfaces: Interfaces

    def missing_module(self, name: str) -> _Missing | None:
        """Return why a module cannot be imported, or should not be."""
        top, _, rest = name.partition(".")
        if not top:  # a relative import; '.' without a file is a folder
            is_found = self._is_local(name) or not name.strip(".")
            return None if is_found else _Missing(f"no module named '{name}'")
        if top == "composer":
            return _of_composer(name)
        if top not in sys.stdlib_module_names and self._is_local(name):
            return None
        if top in self.interfaces.packages():
            return self._package_part(top, rest)
        is_known = top in sys.stdlib_module_names or top in _USUAL or is_installed(top)
        if not is_known or (rest and top in sys.stdlib_module_names and not _has_file(name)):
            return self._not_found(name, top)
        return None

    def missing_names(
        self, module: str, node: ast.ImportFrom
    ) -> Iterator[tuple[_Missing, ast.alias]]:
        """Yield the names that a ``from`` import expects in a module and that are not there."""
        names = self._names(module)
        aliases = [alias for alias in node.names if self._lacks(module, names, alias.name)]
        listed = [alias.name for alias in aliases]
        home = self._home_of(module, listed) if aliases else None
        if home is not None or (len(aliases) > 1 and len(aliases) == len(node.names)):
            shown = " and ".join(f"'{item}'" for item in listed)  # the module is wrong
            hint = f"import {'it' if len(listed) == 1 else 'them'} from '{home}'" if home else None
            message = f"module '{module}' has no {shown}"
            yield _Missing(message, hint, meant=frozenset(listed)), aliases[0]
            return
        for alias in aliases:  # any other name of the module may have been meant
            known = names or frozenset()
            message = f"module '{module}' has no '{alias.name}'"
            yield _Missing(message, suggestion(alias.name, known), meant=known), alias

    def _not_found(self, name: str, top: str) -> _Missing:
        nodes = walk(self.module.tree.body)
        used = {dotted(node) for node in nodes if isinstance(node, ast.Attribute | ast.Name)}
        if used & _AT_RUN_TIME:
            message = f"no module named '{name}' is found: the file searches for modules itself"
            return _Missing(message, part=top, family=Family.NOT_INSTALLED)
        nearby = nearby_modules(name, self.folder, Project.at(self.folder))
        if nearby.package or top in sys.stdlib_module_names:
            part, hint = name.partition(".")[2], None
            if nearby.package:
                part, hint = nearby.missing, nearby.hint
            return _Missing(f"no module named '{name}'", hint, part)
        close = next(self._similar(top), None)
        if close is None:
            message, hint = (
                f"no module named '{top}' is installed",
                "install it, or correct the name",
            )
            return _Missing(message, hint, top, family=Family.NOT_INSTALLED)
        hint = f"did you mean '{close}'?"
        return _Missing(f"no module named '{top}'", hint, top, frozenset({close}))

    def _similar(self, name: str) -> Iterator[str]:
        """Yield a similar module of the project, and public ones that differ in a letter."""
        folders = (self.module.path.parent, self.folder)
        files = [
            path for folder in folders for path in sorted(folder.glob("*.py"))[:_MAXIMUM_FILES]
        ]
        close = nearest(name, (path.stem for path in files))
        yield from (close,) if close is not None else ()
        for other in (*self.interfaces.packages(), *_USUAL, *sorted(sys.stdlib_module_names)):
            if other[0] != "_" and (is_typo(name, other) or name.rstrip("s") == other.rstrip("s")):
                yield other

    def _package_part(self, package: str, rest: str) -> _Missing | None:
        first = rest.partition(".")[0]
        if first in ("", *_INTERFACE_FOLDERS) or _has_file(f"{package}.{first}"):
            return None
        folders = [item for item in _INTERFACE_FOLDERS if self._in_folder(package, item)]
        return _Missing(f"no module named '{package}.{rest}'", suggestion(rest, folders), rest)

    def _is_local(self, name: str) -> bool:
        try:
            return self._local(name) is not None
        except Unreadable:
            return True

    def _local(self, name: str) -> Path | None:
        """Return the file of a module in the project. Raises Unreadable."""
        rest = name.lstrip(".")
        if rest != name:
            return relative_module_file(rest, len(name) - len(rest), self.module.path)
        for home in dict.fromkeys((self.module.path.parent, self.folder)):
            project = Project.at(home)
            path = module_file(name, home, project)
            if path is not None and _is_in_project(path, home, project):
                return path
        return None

    def _lacks(self, module: str, names: frozenset[str] | None, name: str) -> bool:
        """Return whether a module with the given names has no such name."""
        if name == "*" or (name.startswith("__") and name.endswith("__")):
            return False
        if names is None:
            return self._home_of(module, [name]) is not None
        if module.partition(".")[0] in self.interfaces.packages():
            # Python also has Trigger_Request, and private modules.
            return not name.startswith("_") and name.partition("_")[0] not in names
        is_typed = module == _TYPED and name.endswith(SUFFIX)
        part = f"{module}{name}" if module.endswith(".") else f"{module}.{name}"
        return name not in names and not is_typed and not self._is_local(part)

    def _names(self, module: str) -> frozenset[str] | None:
        """Return the names that can be imported from a module; None if they are not known."""
        package, _, folder = module.partition(".")
        if module in _NAMES:
            return _NAMES[module]
        if package == "composer" or package in sys.stdlib_module_names:
            return None
        try:
            path = self._local(module)
            if path is not None:
                own = read_module(path, shown_path(path))
                return None if own.dynamic else defined_names(own)
        except Unreadable:
            return None
        is_interface = package in self.interfaces.packages() and folder in _INTERFACE_FOLDERS
        return self._in_folder(package, folder) if is_interface else None

    def _in_folder(self, package: str, folder: str) -> frozenset[str]:
        prefix = f"{package}/{folder}/"
        names = self.interfaces.names(folder)
        return frozenset(name.removeprefix(prefix) for name in names if name.startswith(prefix))

    def _home_of(self, module: str, names: Sequence[str]) -> str | None:
        """Return the only module that has all these interfaces: in the same package, or any."""
        package, _, folder = module.partition(".")
        if package not in self.interfaces.packages() or folder not in ("", *_INTERFACE_FOLDERS):
            return None
        others = [f"{other}.{folder}" for other in self.interfaces.packages() if folder]
        for modules in ([f"{package}.{part}" for part in _INTERFACE_FOLDERS], others):
            paths = {home: home.replace(".", "/") for home in modules}
            homes = [
                home
                for home, path in paths.items()
                if all(self.interfaces.find(f"{path}/{name}") is not None for name in names)
            ]
            if homes:
                return homes[0] if len(homes) == 1 else None
        return None


def _of_composer(name: str) -> _Missing | None:
    if name in ("composer", *_NAMES):
        return None
    if _has_file(name):
        message = f"'{name}' is internal to the composer and may change without notice"
        hint = f"behaviors import from '{_API}' only"
        return _Missing(message, hint, name, family=Family.INTERNAL)
    close = nearest(name, _NAMES)
    hint = f"did you mean '{close}'?" if close else f"behaviors import from '{_API}'"
    return _Missing(f"no module named '{name}'", hint, name)


def _has_file(name: str) -> bool:
    """Return whether a module outside of the project exists."""
    home = Path(__file__).parent
    return name in sys.modules or module_file(name, home, Project.at(home)) is not None


def _is_in_project(path: Path, home: Path, project: Project) -> bool:
    if {"site-packages", "dist-packages"}.intersection(path.parts):
        return False
    return any(path.is_relative_to(folder) for folder in (home, *project.node_folders))


def _unconditional(body: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """Yield the statements of a file, except where a failing import is handled or expected."""
    pending = list(body[::-1])
    while pending:
        node = pending.pop()
        yield node
        is_suppressed = isinstance(node, ast.With) and "suppress(" in ast.unparse(node.items[0])
        if isinstance(node, ast.If | ast.Match) or is_suppressed:
            continue
        inner = [item for name in _BODIES for item in getattr(node, name, ())]
        if isinstance(node, ast.Try) and any(catches(x, _IMPORT_ERRORS) for x in node.handlers):
            inner = [*node.orelse, *node.finalbody]
        pending.extend(inner[::-1])


def _problem(
    missing: _Missing, name: str, node: ast.alias | ast.ImportFrom, module: Module
) -> Problem:
    start = start_span(node, len(name), module.source)
    text = module.source.line(start.line)
    offset = len("from ") if isinstance(node, ast.ImportFrom) else 0
    column = text.find(name, start.column - 1 + offset)
    if column >= 0:
        start = Span(module.source, start.line, column + 1, len(name))
    part = name.find(missing.part) if missing.part else -1
    span = start.part(part, len(missing.part)) if part >= 0 else start
    return Problem(missing.family, missing.message, span, missing.hint)
