"""Checks the imports of the files of a behavior."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Sequence
from dataclasses import field
from functools import cached_property
from pathlib import Path

from composer.behavior_checks.attributes.module_attributes import module_attributes
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Module, nearby_modules
from composer.behavior_source.library import is_standard, standard_names
from composer.behavior_source.method_body import asks_for_system, catches, dotted
from composer.behavior_source.modules import (
    Unreadable,
    is_installed,
    module_file,
    relative_module_file,
)
from composer.behavior_source.spans import start_span
from composer.behavior_source.syntax import read_module
from composer.behavior_types.api import API_NAMES
from composer.behavior_types.syntax.module_names import module_names
from composer.diagnostics import nearest, suggestion
from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.project import Project
from composer.source import Span, shown_path

_API = "composer.behavior"
_FOLDERS = ("msg", "srv", "action")
#: Packages that behaviors often import. They need not be installed where files are validated.
_USUAL = (
    *("ament_index_python", "composer", "cv2", "cv_bridge", "launch", "launch_ros"),
    *("message_filters", "numpy", "rclpy", "sensor_msgs_py", "tf2_geometry_msgs", "tf2_py"),
    *("tf2_ros", "tf2_sensor_msgs", "tf_transformations"),
)
#: Fields of statements that contain statements.
_BODIES = ("body", "handlers", "orelse", "finalbody", "cases")
_IMPORT_ERRORS = frozenset({"ImportError", "ModuleNotFoundError", "Exception", "BaseException"})


@dataclass(frozen=True, slots=True)
class _Missing:
    """A module or a name that cannot be imported; ``part`` is the misspelled part of its name."""

    message: str
    hint: str | None = None
    part: str = ""
    meant: str | None = None
    kind: Kind = Kind.IMPORT


def import_problems(
    module: Module, folder: Path, interfaces: Interfaces
) -> Iterator[tuple[CodeProblem, frozenset[str]]]:
    """Yield the problems of the imports in a file, each with the names that may be meant."""
    projects = {home: Project.at(home) for home in (module.path.parent, folder)}
    checker = _Imports(module, folder, interfaces, projects)
    for node in _unguarded(module.tree.body):
        if isinstance(node, ast.Import):
            for alias in node.names:
                found = checker.missing_module(alias.name)
                if found is not None:
                    is_known = found.meant is not None and alias.asname is None
                    meant = frozenset({found.meant} if found.meant and is_known else ())
                    yield _problem(found, alias.name, alias, module), meant
        elif isinstance(node, ast.ImportFrom):
            yield from checker.imported_from(node)
    yield from ((problem, frozenset()) for problem in module_attributes(module))


@dataclass(frozen=True)
class _Imports:
    module: Module
    folder: Path
    interfaces: Interfaces
    #: The projects of the folder of the file and of ``folder``.
    projects: dict[Path, Project]
    _files: dict[str, Path | None] = field(default_factory=dict)
    _unreadable: dict[str, str] = field(default_factory=dict)
    _known: dict[str, frozenset[str] | None] = field(default_factory=dict)

    def imported_from(self, node: ast.ImportFrom) -> Iterator[tuple[CodeProblem, frozenset[str]]]:
        """Check a ``from`` import."""
        if node.level:
            yield from self._relative(node)
            return
        name = node.module or ""
        found = self.missing_module(name)
        if found is not None:
            yield _problem(found, name, node, self.module, offset=len("from ")), frozenset()
            return
        missing = [alias for alias in node.names if self._lacks(name, alias.name)]
        listed = [alias.name for alias in missing]
        home = self._home_of(name, listed) if missing else None
        if home is not None or (len(missing) > 1 and len(missing) == len(node.names)):
            shown = " and ".join(f"'{item}'" for item in listed)  # the module is wrong
            hint = f"import {'it' if len(listed) == 1 else 'them'} from '{home}'" if home else None
            problem = _Missing(f"module '{name}' has no {shown}", hint)
            yield _problem(problem, listed[0], missing[0], self.module), frozenset(listed)
            return
        for alias in missing:
            names = self._known[name] or frozenset()
            problem = _Missing(
                f"module '{name}' has no '{alias.name}'", suggestion(alias.name, names)
            )
            # Any other name of the module may have been meant.
            yield _problem(problem, alias.name, alias, self.module), names

    def _lacks(self, module: str, name: str) -> bool:
        """Return whether a module has no such name."""
        if name == "*" or self._is_interface(module, name):
            return False
        if module not in self._known:
            self._known[module] = self._names(module)
        names = self._known[module]
        if names is None:  # a package of interfaces
            return self._home_of(module, [name]) is not None
        return not self._has(module, names, name)

    def _home_of(self, module: str, names: list[str]) -> str | None:
        """Return the only module that has all these interfaces: in the same package, or any."""
        package, _, folder = module.partition(".")
        if package not in self.interfaces.packages() or folder not in ("", *_FOLDERS):
            return None
        own = [f"{package}.{part}" for part in _FOLDERS]
        found = [item for item in own if all(self._is_interface(item, name) for name in names)]
        if not found and folder:
            others = (f"{other}.{folder}" for other in self.interfaces.packages())
            found = [item for item in others if all(self._is_interface(item, n) for n in names)]
        return found[0] if len(found) == 1 else None

    def missing_module(self, name: str) -> _Missing | None:
        """Return why a module cannot be imported, or should not be."""
        top, _, rest = name.partition(".")
        if self._local(name) is not None:
            return None
        if name in self._unreadable:
            return _Missing(f"module '{name}' {self._unreadable[name]}", part=name)
        if top == "composer":
            return _of_composer(name)
        if top in self.interfaces.packages():
            return self._package_part(top, rest)
        if is_standard(top):
            try:
                standard_names(name)
            except LookupError:
                parent = name.rpartition(".")[0]
                names = standard_names(parent) if is_standard(parent) else None
                last = name.rpartition(".")[2]
                hint = suggestion(last, names) if names and nearest(last, names) else None
                return _Missing(f"no module named '{name}'", hint, last)
            return None
        if is_installed(top) or top in _USUAL:
            return None
        nearby = nearby_modules(name, *self._place)
        if nearby.package:
            return _Missing(f"no module named '{name}'", nearby.hint, nearby.missing)
        close = nearest(top, self._modules)
        if close is None:
            hint = "install it, or correct the name"
            message = f"no module named '{top}' is installed"
            return _Missing(message, hint, top, kind=Kind.NOT_INSTALLED)
        return _Missing(f"no module named '{top}'", f"did you mean '{close}'?", top, close)

    def _package_part(self, package: str, rest: str) -> _Missing | None:
        if rest.partition(".")[0] in ("", *_FOLDERS) or is_installed(package):
            first = rest.partition(".")[0]
            if first in ("", *_FOLDERS) or module_file(f"{package}.{first}", *self._place):
                return None
        hint = suggestion(rest, [item for item in _FOLDERS if self._in_folder(package, item)])
        return _Missing(f"no module named '{package}.{rest}'", hint, rest)

    @property
    def _place(self) -> tuple[Path, Project]:
        return self.folder, self.projects[self.folder]

    def _local(self, name: str) -> Path | None:
        """Return the file of a module next to the importing one, or in the project."""
        if name not in self._files:
            self._files[name] = self._find_local(name)
        return self._files[name]

    def _find_local(self, name: str) -> Path | None:
        top = name.partition(".")[0]
        if is_standard(top) or top == "composer":
            return None
        for home, project in self.projects.items():
            try:
                found = module_file(name, home, project)
            except Unreadable as error:
                self._unreadable[name] = str(error)
                return None
            if found is not None and _is_in_project(found, home, project):
                return found
        return None

    @cached_property
    def _modules(self) -> tuple[str, ...]:
        """The modules that a misspelled name may mean."""
        known = {*sys.stdlib_module_names, *self.interfaces.packages(), *self._siblings(), *_USUAL}
        return tuple(name for name in known if name[0] != "_")

    def _siblings(self) -> Iterator[str]:
        for folder in (self.module.path.parent, self.folder):
            yield from (path.stem for path in sorted(folder.glob("*.py"))[:200])

    def _in_folder(self, package: str, folder: str) -> tuple[str, ...]:
        prefix = f"{package}/{folder}/"
        names = self.interfaces.names(folder)
        return tuple(name.removeprefix(prefix) for name in names if name.startswith(prefix))

    def _names(self, module: str) -> frozenset[str] | None:
        """Return the names that can be imported from a module; None if they are not known."""
        local = self._local(module)
        if local is not None:
            return _names_in(local)
        if module == _API:
            return API_NAMES | {"Any"}
        package, _, folder = module.partition(".")
        if package in self.interfaces.packages():
            return frozenset(self._in_folder(package, folder)) if folder in _FOLDERS else None
        if package == "rclpy":
            return self._names_of_rclpy(module)
        return standard_names(module) if is_standard(module) else None

    def _names_of_rclpy(self, module: str) -> frozenset[str] | None:
        """Return the names that a module of the installed rclpy defines."""
        try:
            path = module_file(module, *self._place)
        except Unreadable:
            return None
        names = _names_in(path) if path is not None else None
        if path is None or names is None or path.name != "__init__.py":
            return names
        return names | {item.name.partition(".")[0] for item in path.parent.iterdir()}

    def _is_interface(self, module: str, name: str) -> bool:
        return self.interfaces.find(f"{module.replace('.', '/')}/{name}") is not None

    def _has(self, module: str, names: frozenset[str], name: str) -> bool:
        if name in names or (name.startswith("__") and name.endswith("__")):
            return True
        if module.partition(".")[0] in self.interfaces.packages():
            # Python also has Trigger_Request, and private modules.
            return name.startswith("_") or name.partition("_")[0] in names
        return self._local(f"{module}.{name}") is not None

    def _relative(self, node: ast.ImportFrom) -> Iterator[tuple[CodeProblem, frozenset[str]]]:
        path = relative_module_file(node.module or "", node.level, self.module.path)
        name = "." * node.level + (node.module or "")
        if path is None and node.module:
            missing = _Missing(f"no module named '{name}'")
            yield _problem(missing, name, node, self.module, offset=len("from ")), frozenset()


def _of_composer(name: str) -> _Missing | None:
    if name in ("composer", _API):
        return None
    close = nearest(name, [_API])
    path = module_file(name, Path(__file__).parent.parent.parent, Project.at(Path(__file__).parent))
    if path is None:
        hint = f"did you mean '{_API}'?" if close else f"behaviors import from '{_API}'"
        return _Missing(f"no module named '{name}'", hint, name)
    return _Missing(
        f"'{name}' is internal to the composer and may change without notice",
        f"behaviors import from '{_API}' only",
        name,
        kind=Kind.INTERNAL,
    )


def _is_in_project(path: Path, home: Path, project: Project) -> bool:
    if {"site-packages", "dist-packages"}.intersection(path.parts):
        return False
    return path.is_relative_to(home) or any(
        path.is_relative_to(folder) for folder in project.node_folders
    )


def _names_in(path: Path) -> frozenset[str] | None:
    """Return the names that a file of the project defines; None if it may have others."""
    try:
        return module_names(read_module(path, shown_path(path)))
    except Unreadable:
        return None


def _unguarded(body: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """Yield the statements of a file, except where a failing import is handled or expected."""
    pending = list(body[::-1])
    while pending:
        node = pending.pop()
        yield node
        if isinstance(node, ast.Try) and any(
            catches(item, _IMPORT_ERRORS) for item in node.handlers
        ):
            inner: list[ast.AST] = [*node.handlers, *node.orelse, *node.finalbody]
        elif isinstance(node, ast.If) and _is_type_checking(node.test):
            inner = [*node.orelse]
        elif isinstance(node, ast.If) and asks_for_system([node.test]):
            inner = []
        else:
            inner = [item for name in _BODIES for item in getattr(node, name, ())]
        pending.extend(inner[::-1])


def _is_type_checking(test: ast.expr) -> bool:
    return dotted(test).endswith("TYPE_CHECKING")


def _problem(
    missing: _Missing,
    name: str,
    node: ast.alias | ast.ImportFrom,
    module: Module,
    *,
    offset: int = 0,
) -> CodeProblem:
    start = start_span(node, len(name), module.source)
    text = module.source.line(start.line)
    column = text.find(name, start.column - 1 + offset)
    if column >= 0:
        start = Span(module.source, start.line, column + 1, len(name))
    part = name.find(missing.part) if missing.part else -1
    span = start.part(part, len(missing.part)) if part >= 0 else start
    return CodeProblem(missing.kind, missing.message, span, missing.hint)
