"""The index of interfaces: finds a definition by name and reads it once."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

from composer.diagnostics import nearest, suggestion
from composer.interfaces.definitions import Action, Interface, Message, Service
from composer.interfaces.parser import DefinitionError, parse_definition, split_name
from composer.interfaces.share_json import read_description
from composer.interfaces.sources import (
    Bundle,
    Definition,
    InterfaceSource,
    find_packages,
    installed_prefixes,
)
from composer.source import shown_path


@dataclass(frozen=True, slots=True)
class InvalidDefinition:
    """A definition that was found but cannot be read."""

    name: str
    path: str
    line: int
    message: str

    def __str__(self) -> str:
        return f"the definition of '{self.name}' cannot be read: {self.message}"

    @property
    def place(self) -> str:
        """The location as file and line."""
        return f"{shown_path(Path(self.path))}:{self.line}"


class Interfaces:
    """All known interfaces. A definition is read on first use."""

    def __init__(self, sources: Iterable[InterfaceSource]) -> None:
        self._sources = tuple(sources)
        self._found: dict[str, Interface | InvalidDefinition | None] = {}

    @classmethod
    def load(cls, folders: Iterable[Path] = ()) -> Interfaces:
        """Return the interfaces in ``folders``, in installed packages, and in the snapshot.

        The first source with a definition wins: packages of the project are about to be built and
        installed, installed packages are used at run time, and the snapshot is used if ROS is not
        installed.
        """
        return cls((find_packages(folders), *installed_prefixes(), Bundle()))

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

    def packages(self) -> frozenset[str]:
        """Return the packages that define interfaces."""
        return frozenset().union(*(source.packages() for source in self._sources))

    def names(self, folder: str) -> tuple[str, ...]:
        """Return the names of all interfaces in ``folder`` (msg, srv or action), sorted."""
        return tuple(sorted({name for source in self._sources for name in source.names(folder)}))

    def _look_up(self, name: str) -> Interface | InvalidDefinition | None:
        if name not in self._found:
            self._found[name] = self._read(name)
        return self._found[name]

    def _read(self, name: str) -> Interface | InvalidDefinition | None:
        if split_name(name) is None:
            return None
        for source in self._sources:
            definition = source.read(name)
            if definition is not None:
                return _parse(name, definition)
        return None


def _parse(name: str, definition: Definition) -> Interface | InvalidDefinition:
    try:
        if definition.is_json:
            return read_description(name, definition.text)
        return parse_definition(name, definition.text)
    except DefinitionError as error:
        return InvalidDefinition(name, definition.path, error.line, error.message)
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
