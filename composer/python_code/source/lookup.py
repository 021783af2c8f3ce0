"""Looks up the class that ``behavior: module:Class`` refers to."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import field
from pathlib import Path

from composer.fast_dataclass import dataclass
from composer.model import BehaviorReference
from composer.project import Project
from composer.python_code.source.modules import (
    Unreadable,
    is_compiled,
    local_module_file,
    module_file,
    relative_module_file,
    top_package,
)
from composer.python_code.source.syntax import Class, Import, Method, Module, read_module
from composer.source import Span, shown_path

#: Maximum number of files to read for one behavior.
MAXIMUM_MODULES = 32

#: Folders of installed packages; a virtual environment may be in the folder of the project.
_INSTALLED = frozenset({"site-packages", "dist-packages"})
#: Bases without handlers: the base class of behaviors, and those of the standard library.
_PLAIN_BASES = frozenset(
    {
        ("composer.behavior", "Behavior"),
        ("", "object"),
        ("abc", "ABC"),
        ("typing", "Generic"),
        ("typing", "Protocol"),
    }
)


@dataclass(frozen=True, slots=True)
class BehaviorSource:
    """The syntax of a behavior.

    ``complete`` is true if ``methods`` contains all methods; only then can one be missing.
    ``problem`` is the reason why a module that exists cannot be read, ``problem_span`` its location
    in the module. ``classes`` are the class and its bases, nearest first, each with its module;
    bases that cannot be found are left out. ``own_modules`` are the files of the project that were
    read: those of the classes, and the modules that they import. ``broken`` are the modules of the
    project that are not Python, with the reason and its location.
    """

    reference: BehaviorReference
    module_found: bool = False
    class_found: bool = False
    complete: bool = False
    path: Path | None = None
    problem: str | None = None
    problem_span: Span | None = field(default=None, compare=False)
    class_names: tuple[str, ...] = ()
    class_span: Span | None = field(default=None, compare=False)
    methods: tuple[Method, ...] = ()
    classes: tuple[tuple[Module, Class], ...] = field(default=(), repr=False, compare=False)
    own_modules: tuple[Module, ...] = field(default=(), repr=False, compare=False)
    broken: tuple[tuple[str, Span], ...] = field(default=(), repr=False, compare=False)

    @property
    def own_classes(self) -> Iterator[tuple[Module, Class]]:
        """The classes in the project's own files, not in installed packages."""
        own = {module.path for module in self.own_modules}
        yield from (found for found in self.classes if found[0].path in own)

    @property
    def classes_outside_ros(self) -> Iterator[tuple[Module, Class]]:
        """The class and its bases, without those of rclpy."""
        yield from (item for item in self.classes if top_package(item[0].path) != "rclpy")

    def method(self, name: str) -> Method | None:
        """Return the method ``name``, own or inherited; None if it is not known."""
        return next((method for method in self.methods if method.name == name), None)


def find_behavior(
    reference: BehaviorReference, known_bases: frozenset[tuple[str, str]] = frozenset()
) -> BehaviorSource:
    """Read the class that ``reference`` names. Never raises, never imports.

    ``known_bases`` are classes, by module and name, whose methods do not matter: they are not read.
    """
    plain = _PLAIN_BASES | known_bases
    reader = _Reader(reference.folder, Project.at(reference.folder), plain)
    try:
        path = module_file(reference.module, reference.folder, reader.project)
        module = reader.module(path) if path is not None else None
    except Unreadable as error:
        return BehaviorSource(
            reference, module_found=True, problem=str(error), problem_span=error.span
        )
    if module is None:
        compiled = is_compiled(reference.module)
        return BehaviorSource(reference, module_found=compiled, class_found=compiled)
    names = tuple(module.classes)
    start = reader.lookup(module, reference.class_name)
    if start is None:
        return BehaviorSource(
            reference,
            module_found=True,
            class_found=module.may_have(reference.class_name),
            path=path,
            class_names=names,
        )
    methods: dict[str, Method] = {}
    complete = True
    classes = tuple(reader.with_bases(*start))
    reader.read_helpers(module)
    for found in classes:
        complete = complete and found is not None and not found[1].dynamic
        for method in found[1].methods if found is not None else ():
            methods.setdefault(method.name, method)
    return BehaviorSource(
        reference,
        module_found=True,
        class_found=True,
        complete=complete,
        path=path,
        class_names=names,
        class_span=start[1].span,
        methods=tuple(methods.values()),
        classes=tuple(found for found in classes if found is not None),
        own_modules=tuple(filter(reader.is_own, reader.modules.values())),
        broken=tuple(reader.broken.values()),
    )


_ClassInModule = tuple[Module, Class]


@dataclass(slots=True)
class _Reader:
    """Resolves names across modules."""

    folder: Path
    project: Project
    plain_bases: frozenset[tuple[str, str]]
    modules: dict[Path, Module] = field(default_factory=dict)
    broken: dict[Path, tuple[str, Span]] = field(default_factory=dict)

    def module(self, path: Path) -> Module:
        """Return a module, read once. Raises Unreadable."""
        if path not in self.modules:
            if len(self.modules) >= MAXIMUM_MODULES:
                raise Unreadable("depends on too many other files")
            self.modules[path] = read_module(path, shown_path(path))
        return self.modules[path]

    def is_own(self, module: Module) -> bool:
        """Return whether a file belongs to the project."""
        path = module.path
        return self.project.holds(path) and not _INSTALLED.intersection(path.parts)

    def read_helpers(self, start: Module) -> None:
        """Read the modules of the project that ``start`` imports, and those that they import."""
        pending = [start, *self.modules.values()]
        seen: set[Path] = set()
        while pending:
            module = pending.pop()
            if module.path in seen or not self.is_own(module):
                continue
            seen.add(module.path)
            for path in self._imported_files(module):
                try:
                    pending.append(self.module(path))
                except Unreadable as error:  # imports without a place are reported by their rule
                    if error.span is not None and self.project.holds(path):
                        self.broken[path] = (f"module '{path.stem}' {error}", error.span)

    def _imported_files(self, module: Module) -> Iterator[Path]:
        """Yield the files of the project that a module imports."""
        home = module.path.parent
        for imported in module.imports.values():
            names = [imported.module]
            if imported.name:  # 'from package import module' is one if there is a file
                names.append(f"{imported.module}.{imported.name}".strip("."))
            for name in names:
                if imported.level:
                    path = relative_module_file(name, imported.level, module.path)
                    if path is not None and self.project.holds(path):
                        yield path
                elif name.partition(".")[0] not in sys.stdlib_module_names:
                    yield from self._local_files(name, home)

    def _local_files(self, name: str, home: Path) -> Iterator[Path]:
        for folder in dict.fromkeys((home, self.folder)):
            with suppress(Unreadable):
                path = local_module_file(name, folder, self.project)
                if path is not None:
                    yield path
                    return

    def with_bases(self, module: Module, start: Class) -> Iterator[_ClassInModule | None]:
        """Yield a class and all its bases, nearest first; None for a base that cannot be found."""
        seen: set[tuple[Path, str]] = set()
        pending: list[_ClassInModule] = [(module, start)]
        while pending:
            home, known = pending.pop()
            if (home.path, known.name) in seen:
                continue
            seen.add((home.path, known.name))
            yield home, known
            for base in reversed(known.bases):
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
            imported = imported_from(module, name)
            if imported is None:
                return None
            following = self._imported_module(module, imported)
            if following is None:
                return None
            module, name = following, imported.name
        return None

    def _imported_module(self, module: Module, imported: Import) -> Module | None:
        try:
            path = self._imported_file(module, imported)
            return self.module(path) if path is not None else None
        except Unreadable:
            return None

    def _imported_file(self, module: Module, imported: Import) -> Path | None:
        if not imported.level:
            home = module.path.parent
            sibling = module_file(imported.module, home, Project.at(home))
            return sibling or module_file(imported.module, self.folder, self.project)
        path = relative_module_file(imported.module, imported.level, module.path)
        if path is None or (self.project.holds(module.path) and not self.project.holds(path)):
            return None
        return path

    def _is_plain(self, module: Module, base: str) -> bool:
        if base == "object":
            return True
        imported = imported_from(module, base)
        return imported is not None and (imported.module, imported.name) in self.plain_bases


def imported_from(module: Module, name: str) -> Import | None:
    """Return the origin of a name that ``module`` imports: ``Base``, or ``package.Base``."""
    if name in module.imports:
        found = module.imports[name]
        return found if found.name else None
    prefix, _, last = name.rpartition(".")
    found_module = module.imports.get(prefix)
    if not last or found_module is None:
        return None
    if found_module.name:  # from package import module
        dotted = f"{found_module.module}.{found_module.name}".lstrip(".")
        return Import(dotted, last, found_module.level)
    return Import(found_module.module, last)
