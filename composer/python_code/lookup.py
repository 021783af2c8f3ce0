"""Looks up the class that ``behavior: module:Class`` refers to."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import field
from functools import cached_property
from itertools import chain
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span, shown_path
from composer.model import BehaviorReference
from composer.project import Project
from composer.python_code.modules import (
    PYTHON_SUFFIX,
    Unreadable,
    local_module_file,
    module_file,
    module_origin,
    relative_module_file,
)
from composer.python_code.syntax import Class, Method, Module, defined_names, read_module
from composer.python_code.trees import Import

_Finder = Callable[[str, Path, Project], Path | None]
#: Maximum number of files to read for one behavior.
MAXIMUM_MODULES = 32

#: Folders of installed packages; a virtual environment may be in the folder of the project.
_INSTALLED = frozenset({"site-packages", "dist-packages"})
#: Modules whose classes have no handlers, besides those of rclpy.
_PLAIN_MODULES = frozenset({"abc", "composer.behavior", "composer.typed", "typing"})


@dataclass(frozen=True, slots=True)
class BrokenModule:
    """A file of the project that is not Python. The span's file has the text."""

    path: Path
    message: str
    span: Span


@dataclass(frozen=True)
class BehaviorSource:
    """The syntax of a behavior.

    ``complete`` is true if ``methods`` contains all methods; only then can one be missing.
    ``problem`` is the reason why a module that exists cannot be read. ``classes`` are the class and
    its bases, nearest first, each with its module; bases that cannot be found are left out.
    ``own_modules`` are the files of the project that were read: those of the classes, and the
    modules that they import. ``broken`` are those that are not Python.
    """

    reference: BehaviorReference
    module_found: bool = False
    class_found: bool = False
    complete: bool = False
    path: Path | None = None
    problem: str | None = None
    class_names: tuple[str, ...] = ()
    classes: tuple[tuple[Module, Class], ...] = field(default=(), repr=False, compare=False)
    own_modules: tuple[Module, ...] = field(default=(), repr=False, compare=False)
    broken: tuple[BrokenModule, ...] = field(default=(), repr=False, compare=False)

    @property
    def class_span(self) -> Span | None:
        """Where the class is defined."""
        return self.classes[0][1].span if self.classes else None

    @cached_property
    def by_name(self) -> Mapping[str, Method]:
        """The methods by name; the nearest class wins."""
        every = [method for _, class_ in self.classes for method in class_.methods]
        nearest = {method.name: method for method in reversed(every)}
        return {method.name: nearest[method.name] for method in every}

    @property
    def methods(self) -> Collection[Method]:
        """The methods of the class and its bases, the nearest class first."""
        return self.by_name.values()

    @property
    def own_classes(self) -> Iterator[tuple[Module, Class]]:
        """The classes in the project's own files, not in installed packages."""
        own = {module.path for module in self.own_modules}
        yield from (item for item in self.classes if item[0].path in own)

    @property
    def is_rclpy_node(self) -> bool:
        """Whether a base class comes from rclpy."""
        return any(
            origin is not None and is_of_rclpy(origin)
            for module, class_ in self.classes
            for origin in (imported_from(module, base) for base in class_.bases)
        )

    def method(self, name: str) -> Method | None:
        """Return the method ``name``, own or inherited; None if it is not known."""
        return self.by_name.get(name)


def find_behavior(
    reference: BehaviorReference, project_at: Callable[[Path], Project] = Project.at
) -> BehaviorSource:
    """Read the class that ``reference`` names. Never raises, never imports.

    ``project_at`` returns the project of a folder.
    """
    reader = _Reader(reference.folder, project_at(reference.folder))
    try:
        path = module_origin(reference.module, reference.folder, reader.project)
        is_source = path is not None and path.suffix == PYTHON_SUFFIX
        module = reader.module(path) if path is not None and is_source else None
    except Unreadable as error:
        broken = tuple(reader.broken.values())
        return BehaviorSource(reference, module_found=True, problem=str(error), broken=broken)
    if module is None:
        is_compiled = path is not None and not is_source
        return BehaviorSource(reference, module_found=is_compiled, class_found=is_compiled)
    start = reader.lookup(module, reference.class_name)
    classes = [*reader.with_bases(*start)] if start is not None else []
    if classes:
        reader.read_helpers()
    own_modules = [item for item in reader.modules.values() if reader.is_own(item.path)]
    return BehaviorSource(
        reference,
        module_found=True,
        class_found=bool(classes)
        or module.dynamic
        or reference.class_name in defined_names(module),
        complete=bool(classes) and all(item and not item[1].dynamic for item in classes),
        path=path,
        class_names=tuple(module.classes),
        classes=tuple(item for item in classes if item is not None),
        own_modules=tuple(own_modules if classes else ()),
        broken=tuple(item for item in reader.broken.values() if reader.is_own(item.path)),
    )


_ClassInModule = tuple[Module, Class]


@dataclass(slots=True)
class _Reader:
    """Resolves names across modules."""

    folder: Path
    project: Project
    modules: dict[Path, Module] = field(default_factory=dict)
    broken: dict[Path, BrokenModule] = field(default_factory=dict)
    projects: dict[Path, Project] = field(default_factory=dict)

    def module(self, path: Path) -> Module:
        """Return a module, read once. Raises Unreadable."""
        if path not in self.modules:
            if len(self.modules) >= MAXIMUM_MODULES:
                raise Unreadable("depends on too many other files")
            try:
                self.modules[path] = read_module(path, shown_path(path))
            except Unreadable as error:  # others than errors of syntax are reported by their rule
                if error.span is not None:
                    message = f"module '{path.stem}' {error}"
                    self.broken[path] = BrokenModule(path, message, error.span)
                raise
        return self.modules[path]

    def is_own(self, path: Path) -> bool:
        """Return whether a file belongs to the project."""
        return self.project.holds(path) and not _INSTALLED.intersection(path.parts)

    def read_helpers(self) -> None:
        """Read the modules of the project that those read so far import, and what they import."""
        pending = list(self.modules.values())
        seen: set[Path] = set()
        while pending:
            module = pending.pop()
            if module.path in seen or not self.is_own(module.path):
                continue
            seen.add(module.path)
            others = module.alternatives.values()
            for item in chain(module.imports.values(), *others):
                names = {item.module}
                if item.name:  # 'from package import module' is one if there is a file
                    names.add(f"{item.module}.{item.name}".strip("."))
                for name in names if item.level else names - sys.stdlib_module_names:
                    helper = self._imported(module, name, item.level, local_module_file)
                    pending += [helper] if helper is not None else []

    def with_bases(self, module: Module, start: Class) -> Iterator[_ClassInModule | None]:
        """Yield a class and all its bases, nearest first; None for a base that cannot be found."""
        seen: set[tuple[Path, str]] = set()
        pending: list[_ClassInModule] = [(module, start)]
        while pending:
            home, class_ = pending.pop()
            if (home.path, class_.name) in seen:
                continue
            seen.add((home.path, class_.name))
            yield home, class_
            for base in reversed(class_.bases):
                if self._is_plain(home, base):
                    continue
                found = self.lookup(home, base)
                if found is None:
                    yield None
                else:
                    pending.append(found)

    def lookup(self, module: Module, name: str) -> _ClassInModule | None:
        """Return the class that ``name`` refers to in ``module``, or None if it cannot be found."""
        for _ in range(MAXIMUM_MODULES):
            if name in module.classes:
                return module, module.classes[name]
            origin = imported_from(module, name)
            if origin is None:
                return None
            following = self._imported(module, origin.module, origin.level, module_file)
            if following is None:
                return None
            module, name = following, origin.name
        return None

    def _imported(self, importer: Module, name: str, level: int, find: _Finder) -> Module | None:
        """Return an imported module; None if it is not found or cannot be read."""
        home = importer.path.parent
        with suppress(Unreadable):
            if level:
                path = relative_module_file(name, level, importer.path)
                is_outside = path is not None and not self.project.holds(path)
                if is_outside and self.project.holds(importer.path):
                    return None
            else:
                if home not in self.projects:
                    self.projects[home] = Project.at(home)
                places = {home: self.projects[home], self.folder: self.project}
                files = (find(name, *place) for place in places.items())
                path = next(filter(None, files), None)
            return self.module(path) if path is not None else None
        return None

    @staticmethod
    def _is_plain(module: Module, base: str) -> bool:
        origin = imported_from(module, base)
        if origin is None:
            return base == "object"
        return is_of_rclpy(origin) or origin.module in _PLAIN_MODULES


def is_of_rclpy(origin: Import) -> bool:
    """Return whether something is imported from rclpy, whose classes are not read."""
    return origin.module.partition(".")[0] == "rclpy"


def imported_from(module: Module, name: str) -> Import | None:
    """Return the origin of a name that ``module`` imports: ``Base``, or ``package.Base``."""
    prefix, _, last = name.rpartition(".")
    origin = module.imports.get(prefix or last)
    if origin is None or not prefix:
        return origin if origin is not None and origin.name else None
    if origin.name:  # from package import module
        full = f"{origin.module}.{origin.name}".lstrip(".")
        return Import(full, last, origin.level)
    return Import(origin.module, last)
