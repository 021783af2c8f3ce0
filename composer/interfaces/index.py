"""The index of interfaces: finds a definition by name and reads it once, and shows its text."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from composer.base.diagnostics import nearest, shown, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span, shown_path
from composer.interfaces.definitions import Action, Field, Interface, Message, Service, parts
from composer.interfaces.parser import (
    SEPARATOR,
    DefinitionError,
    parse_definition,
    parse_line,
    split_name,
)
from composer.interfaces.sources import (
    FOLDERS,
    Bundle,
    Definition,
    InterfaceSource,
    Packages,
    Prefix,
    find_packages,
    installed_prefixes,
    read_description,
)

#: A type as descriptions of interfaces name it.
_LONG_TYPE = re.compile(r"(?m)^[ \t]*(?P<package>[a-z]\w*)/msg/(?P<name>[A-Z]\w*)")
#: As in ros2.
_INDENT = "\t"


@dataclass(frozen=True, slots=True)
class InvalidDefinition:
    """A definition that was found but cannot be read."""

    name: str
    path: str
    line: int
    message: str
    text: str = ""
    hint: str | None = None

    @property
    def span(self) -> Span:
        """The line that is wrong."""
        source = SourceFile(shown_path(Path(self.path)), self.text)
        line = source.line(self.line)
        content = line.strip()
        return Span(source, self.line, line.find(content) + 1, max(len(content), 1))

    def __str__(self) -> str:
        return f"the definition of '{self.name}' cannot be read: {self.message}"

    @property
    def place(self) -> str:
        """The location as file and line."""
        return f"{shown_path(Path(self.path))}:{self.line}"


class Interfaces:
    """All known interfaces. A definition is read on first use."""

    def __init__(self, sources: Iterable[InterfaceSource], project: Packages | None = None) -> None:
        """Look for definitions in the packages of the ``project``, then in ``sources``."""
        self._project = project if project is not None else Packages({})
        self._others = tuple(sources)
        self._found: dict[str, Interface | InvalidDefinition | None] = {}
        self._reading: set[str] = set()  # a definition, and those that contain it
        self._installed: dict[str, Interface | None] = {}
        self._packages: frozenset[str] | None = None
        self._names: dict[str, tuple[str, ...]] = {}

    @classmethod
    def load(cls, folders: Iterable[Path] = ()) -> Interfaces:
        """Return the interfaces in ``folders``, in installed packages, and in the snapshot.

        The first source with a definition wins: packages of the project are about to be built and
        installed, installed packages are used at run time, and the snapshot is used if ROS is not
        installed.
        """
        return cls((*installed_prefixes(), Bundle()), find_packages(folders))

    @classmethod
    def installed(cls) -> Interfaces:
        """Return the interfaces in installed packages, which can be used at run time."""
        return cls(installed_prefixes())

    @property
    def _sources(self) -> tuple[InterfaceSource, ...]:
        return (self._project, *self._others)

    def find(self, name: str) -> Message | Service | Action | None:
        """Return the interface ``package/msg/Name`` (or srv, action); None if there is none.

        None too for a definition that cannot be read: ``problem`` says why.
        """
        found = self._look_up(name)
        return None if isinstance(found, InvalidDefinition) else found

    def message(self, name: str) -> Message | None:
        """Return the message ``package/msg/Name``, or None."""
        found = self.find(name)
        return found if isinstance(found, Message) else None

    def problem(self, name: str) -> InvalidDefinition | None:
        """Return the error in the definition of ``name``, or None."""
        found = self._look_up(name)
        return found if isinstance(found, InvalidDefinition) else None

    def text(self, name: str) -> str | None:
        """Return the definition as it is written; None if it is only known as a description."""
        definition = self._definition(name)
        if definition is None or definition.is_json or definition.problem is not None:
            return None
        return definition.text

    def outdated(self, name: str) -> str | None:
        """Return the interface that has to be built again before ``name`` can be used, or None.

        It is ``name`` or a message in it, with a definition in the project that differs from the
        installed one.
        """
        pending, seen = [name], {name}
        while pending:
            current = pending.pop()
            if self._differs(current):
                return current
            found = self.find(current) if self._is_of_project(current) else None
            messages = () if found is None else parts(found).values()
            inner = {field.type.name for part in messages for field in part.fields} - seen
            seen |= inner
            pending += sorted(inner)
        return None

    def source_folder(self, name: str) -> Path | None:
        """Return the folder of the project's package that defines ``name``, or None."""
        return self._project.folders.get(name.partition("/")[0])

    def folder_without_manifest(self, package: str) -> Path | None:
        """Return the folder of ``package`` in the project if it lacks a package.xml, or None."""
        return self._project.without_manifest(package)

    def _is_of_project(self, name: str) -> bool:
        return self.source_folder(name) is not None

    def _differs(self, name: str) -> bool:
        if not self._is_of_project(name):
            return False
        if name not in self._installed:
            self._installed[name] = self._read_installed(name)
        found, installed = self.find(name), self._installed[name]
        return found is not None and installed is not None and found != installed

    def _read_installed(self, name: str) -> Interface | None:
        """Return the definition that was installed as text; descriptions lack the constants."""
        for source in self._others:
            definition = source.read(name) if isinstance(source, Prefix) else None
            if definition is not None:
                parsed = None if definition.is_json else _parse(name, definition)
                return None if isinstance(parsed, InvalidDefinition) else parsed
        return None

    def packages(self) -> frozenset[str]:
        """Return the packages that define interfaces."""
        if self._packages is None:
            self._packages = frozenset().union(*(source.packages() for source in self._sources))
        return self._packages

    def names(self, *folders: str) -> tuple[str, ...]:
        """Return the names of all interfaces in folders (msg, srv, action; default: all), sorted.

        The names of a folder come before the names of the next one.
        """
        for folder in folders or FOLDERS:
            if folder not in self._names:
                names = {name for source in self._sources for name in source.names(folder)}
                self._names[folder] = tuple(sorted(names))
        return tuple(name for folder in folders or FOLDERS for name in self._names[folder])

    def _look_up(self, name: str) -> Interface | InvalidDefinition | None:
        if name not in self._found:
            self._found[name] = None  # in case it contains itself
            self._reading.add(name)
            self._found[name] = self._read(name)
            self._reading.remove(name)
        return self._found[name]

    def _read(self, name: str) -> Interface | InvalidDefinition | None:
        definition = self._definition(name)
        if definition is None:
            return None
        parsed = _parse(name, definition)
        return self._check_fields(parsed, definition) or parsed

    def _definition(self, name: str) -> Definition | None:
        if split_name(name) is None:
            return None
        definitions = (source.read(name) for source in self._sources)
        return next((found for found in definitions if found is not None), None)

    def _check_fields(
        self, interface: Interface | InvalidDefinition, definition: Definition
    ) -> InvalidDefinition | None:
        """Return an error if a field of a project's interface has a type that cannot be used.

        Such a type does not exist, contains the interface itself, has an error in its own
        definition, or is named as only descriptions name it. Types of unknown packages are not
        errors unless their name is misspelled: their definitions may be installed elsewhere.
        """
        if isinstance(interface, InvalidDefinition) or not self._is_of_project(interface.name):
            return None
        long = _LONG_TYPE.search(definition.text)
        if long is not None:
            message = f"types are named without 'msg': '{long['package']}/{long['name']}'"
            line = definition.text.count("\n", 0, long.start("package")) + 1
            return InvalidDefinition(
                interface.name, definition.path, line, message, definition.text
            )
        for field in (field for part in parts(interface).values() for field in part.fields):
            hint = None
            if field.type.is_primitive:
                continue
            if not self._may_exist(field.type.name):
                message = f"field '{field.name}' has the unknown type '{shown(field.type.name)}'"
                hint = self._similar_type(field.type.name)
            elif field.type.name in self._reading:
                message = f"field '{field.name}' makes the message contain itself"
            else:
                nested = self.problem(field.type.name)
                if nested is not None:
                    return nested
                continue
            written = re.search(rf"(?m)^[^#\n]*\s{re.escape(field.name)}\b", definition.text)
            line = definition.text.count("\n", 0, written.start()) + 1 if written else 1
            return InvalidDefinition(
                interface.name, definition.path, line, message, definition.text, hint
            )
        return None

    def _similar_type(self, name: str) -> str | None:
        """Return a hint for an unknown type of a field, with a name as definitions write it."""
        package, _, rest = name.partition("/")
        known = self.packages()
        close = package if package in known else nearest(package, known)
        hint = similar_interface(f"{close}/{rest}", self.names("msg"))
        return hint.replace("/msg/", "/") if hint is not None else None

    def _may_exist(self, name: str) -> bool:
        package, _, rest = name.partition("/")
        if package not in self.packages():
            close = nearest(package, self.packages())
            return close is None or not self._exists(f"{close}/{rest}")
        return self._exists(name)

    def _exists(self, name: str) -> bool:
        return any(source.read(name) is not None for source in self._sources)


def _parse(name: str, definition: Definition) -> Interface | InvalidDefinition:
    if definition.problem is not None:
        return InvalidDefinition(name, definition.path, 1, definition.problem)
    try:
        if definition.is_json:
            return read_description(name, definition.text)
        return parse_definition(name, definition.text)
    except DefinitionError as error:
        return InvalidDefinition(
            name, definition.path, error.line, error.message, definition.text, error.hint
        )
    except ValueError as error:
        return InvalidDefinition(name, definition.path, 1, str(error))


def similar_interface(name: str, known: Collection[str]) -> str | None:
    """Return a hint with the most similar names among ``known``, or None."""
    package, slash, _ = name.partition("/")
    siblings = [other for other in known if other.startswith(f"{package}/")]
    alike = [other for other in known if _stem(other) == _stem(name)]
    found = [other for other in alike if not siblings or other in siblings]
    if not found:
        by_stem = {_stem(other): other for other in (siblings if slash else known)}
        close = nearest(_stem(name), by_stem)
        found = alike or siblings if close is None else [by_stem[close]]
    return f"did you mean '{found[0]}'?" if len(found) == 1 else suggestion(_stem(name), found)


def _stem(name: str) -> str:
    return name.rpartition("/")[2]


def listing(
    name: str, interfaces: Interfaces, *, comments: bool = True, above: tuple[str, ...] = ()
) -> Iterator[str]:
    """Yield the lines of the definition ``name``, each message below the field that has its type.

    ``comments`` are the comments of the outer message, with its empty lines.

    A definition without text, as in the snapshot or of OMG IDL, has no comments. A message that
    contains itself, ``above``, is not expanded again.
    """
    for line in definition_text(name, interfaces).splitlines():
        content = line.partition("#")[0].strip()
        if comments:
            yield line.rstrip()
        elif content:
            yield line.partition("#")[0].rstrip()
        if content in ("", SEPARATOR):
            continue
        field = parse_line(content, name)
        if isinstance(field, Field) and field.type.name not in (name, *above):
            within = (name, *above)
            for inner in listing(field.type.name, interfaces, comments=False, above=within):
                yield f"{_INDENT}{inner}" if inner else ""


def definition_text(name: str, interfaces: Interfaces) -> str:
    """Return the text of a definition, made from its description if need be; empty if unknown."""
    text = interfaces.text(name)
    found = interfaces.find(name)
    if text is None and found is not None:
        return "\n".join(_generated(found))
    return text or ""


def _generated(interface: Interface) -> Iterator[str]:
    for number, message in enumerate(parts(interface).values()):
        if number:
            yield SEPARATOR
        yield from (f"{item.type} {item.name}={item.value}" for item in message.constants)
        yield from map(_field_line, message.fields)


def _field_line(field: Field) -> str:
    return f"{field.type} {field.name}{'' if field.default is None else f' {field.default}'}"
