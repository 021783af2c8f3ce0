"""Sources of definitions: packages of the project, installed packages, a bundled snapshot.

A source finds the text of a definition by name. Names come from user files, so they are split and
checked before they become part of a path.

The type descriptions that rosidl installs (``share/<package>/msg/<Name>.json``) are read for
packages that are written in OMG IDL and have no ``.msg`` text. They hold no constants.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

from composer.base.fast_dataclass import dataclass
from composer.base.files import NotRegularError, read_regular
from composer.base.folders import ament_prefixes
from composer.interfaces.definitions import Field, FieldType, Interface, Message, interface_of
from composer.interfaces.parser import split_name
from composer.language.tree import Plain

FOLDERS = ("msg", "srv", "action")
_MAXIMUM_BYTES = 1_000_000
_MAXIMUM_DEPTH = 4
_NAME = re.compile(r"[a-z][a-z0-9_]{0,200}", re.ASCII)  # a file name
_PACKAGE_NAME = re.compile(r"<name>\s*([a-z][a-z0-9_]*)\s*</name>", re.ASCII)
#: Folders without sources, made by colcon, Python and JavaScript tools.
_SKIPPED = frozenset(("build", "install", "log", "node_modules", "site-packages", "__pycache__"))
#: type_description_interfaces/msg/FieldType, numbers 1 to 22; arrays add 48, 96 or 144 to them.
_TYPE_NAMES: Mapping[int, str] = {
    2: "int8",
    3: "uint8",
    4: "int16",
    5: "uint16",
    6: "int32",
    7: "uint32",
    8: "int64",
    9: "uint64",
    10: "float32",
    11: "float64",
    13: "uint8",
    15: "bool",
    16: "byte",
    17: "string",
    18: "wstring",
    21: "string",
    22: "wstring",
}
_NESTED = 1
_FIXED_ARRAY, _BOUNDED_SEQUENCE, _UNBOUNDED_SEQUENCE = 1, 2, 3
_ROW = 48
#: The field that rosidl adds to empty messages, because C has no empty struct.
_PLACEHOLDER = "structure_needs_at_least_one_member"


@dataclass(frozen=True, slots=True)
class Definition:
    """The text of a definition. ``path`` is empty for bundled definitions.

    ``problem`` says why the file has no text, or None.
    """

    text: str
    path: str = ""
    is_json: bool = False
    problem: str | None = None


class InterfaceSource(Protocol):
    """A source of definitions."""

    def packages(self) -> frozenset[str]:
        """Return the packages with interfaces in this source."""

    def names(self, folder: str) -> Iterator[str]:
        """Yield the full names of all messages, services or actions."""

    def read(self, name: str) -> Definition | None:
        """Return the definition ``name``, or None. Raises OSError, UnicodeDecodeError."""


@dataclass(frozen=True, slots=True)
class Packages:
    """Packages by name, each with the folder that holds its ``msg``, ``srv`` and ``action``."""

    folders: Mapping[str, Path]
    searched: tuple[Path, ...] = ()

    def without_manifest(self, name: str) -> Path | None:
        """Return the folder of definitions ``name`` that lacks a package.xml, or None."""
        if not _NAME.fullmatch(name):
            return None
        for base in (folder / name for folder in self.searched):
            has_interfaces = any((base / kind).is_dir() for kind in FOLDERS)
            if has_interfaces and not (base / "package.xml").exists():
                return base
        return None

    def packages(self) -> frozenset[str]:
        """Return the names of the packages."""
        return frozenset(self.folders)

    def names(self, folder: str) -> Iterator[str]:
        """Yield the names of the interfaces in the packages."""
        for package, base in self.folders.items():
            for path in sorted((base / folder).glob(f"*.{folder}")):
                yield f"{package}/{folder}/{path.stem}"

    def read(self, name: str) -> Definition | None:
        """Return the text of a definition, else its type description."""
        package, folder, type_name = split_name(name) or ("", "", "")
        base = self.folders.get(package)
        return _read(base / folder, type_name, folder) if base is not None else None


@dataclass(frozen=True, slots=True)
class Prefix:
    """An installation prefix, as ``AMENT_PREFIX_PATH`` lists them."""

    root: Path

    def packages(self) -> frozenset[str]:
        """Return the packages that have registered interfaces in the ament index."""
        return frozenset(_listed(self._index))

    def has_package(self, name: str) -> bool:
        """Return whether the ament index lists a package with interfaces."""
        return (self._index / name).is_file()

    def names(self, folder: str) -> Iterator[str]:
        """Yield the names of the installed interfaces."""
        for package in sorted(self.packages()):
            names = _listed(self.root / "share" / package / folder)
            stems = {Path(name).stem for name in names if name.endswith((f".{folder}", ".json"))}
            yield from (f"{package}/{folder}/{stem}" for stem in sorted(stems))

    def read(self, name: str) -> Definition | None:
        """Return the text of a definition, else its type description."""
        package, folder, type_name = split_name(name) or ("", "", "")
        return _read(self.root / "share" / package / folder, type_name, folder) if folder else None

    @property
    def _index(self) -> Path:
        return self.root / "share" / "ament_index" / "resource_index" / "rosidl_interfaces"


@dataclass(frozen=True, slots=True)
class Bundle:
    """The snapshot of ROS 2 Jazzy's message packages that comes with the composer."""

    def packages(self) -> frozenset[str]:
        """Return the packages in the snapshot."""
        return frozenset(name.split("/")[0] for name in _snapshot())

    def names(self, folder: str) -> Iterator[str]:
        """Yield the names in the snapshot."""
        return (name for name in _snapshot() if name.split("/")[1] == folder)

    def read(self, name: str) -> Definition | None:
        """Return a definition of the snapshot."""
        text = _snapshot().get(name)
        return Definition(text) if text is not None else None


def installed_prefixes() -> tuple[Prefix, ...]:
    """Return the prefixes that ROS searches: ``AMENT_PREFIX_PATH``, then this Python's."""
    return tuple(map(Prefix, ament_prefixes()))


def find_packages(folders: Iterable[Path]) -> Packages:
    """Return the interface packages in and below ``folders``: those with a ``package.xml``."""
    found: dict[str, Path] = {}
    searched = tuple(folders)
    for folder in searched:
        for manifest in _manifests(folder, _MAXIMUM_DEPTH):
            name = package_name(manifest)
            has_interfaces = any((manifest.parent / kind).is_dir() for kind in FOLDERS)
            if name is not None and has_interfaces:
                found.setdefault(name, manifest.parent)
    return Packages(found, searched)


def _manifests(folder: Path, depth: int) -> Iterator[Path]:
    """Yield every package.xml, but none below another one or behind symbolic links."""
    manifest = folder / "package.xml"
    if manifest.is_file():
        yield manifest
        return
    if depth == 0:
        return
    for name in sorted(_listed(folder)):
        below = folder / name
        hidden = name.startswith(".") or name in _SKIPPED
        if not hidden and below.is_dir() and not below.is_symlink():
            yield from _manifests(below, depth - 1)


def package_name(manifest: Path) -> str | None:
    """Return the name in a ``package.xml``; None without one."""
    try:
        text = _text(manifest)
    except _Unreadable:
        return None
    match = _PACKAGE_NAME.search(text) if text is not None else None
    return match[1] if match else None


def _listed(folder: Path) -> list[str]:
    try:
        return [path.name for path in folder.iterdir()]
    except OSError:
        return []


def _read(folder: Path, type_name: str, extension: str) -> Definition | None:
    for suffix in (extension, "json"):
        path = folder / f"{type_name}.{suffix}"
        is_json = suffix == "json"
        try:
            text = _text(path)
        except _Unreadable as problem:
            return Definition("", str(path), is_json=is_json, problem=str(problem))
        if text is not None:
            return Definition(text, str(path), is_json=is_json)
    return None


class _Unreadable(Exception):
    """A file exists and has no text."""


def _text(path: Path) -> str | None:
    """Return the text of a regular file, None if there is none. Raises _Unreadable."""
    try:
        text = read_regular(path, _MAXIMUM_BYTES).decode()
        return text.replace("\r\n", "\n").replace("\r", "\n")
    except (FileNotFoundError, NotADirectoryError, NotRegularError):
        return None
    except UnicodeDecodeError as error:
        raise _Unreadable("it is not UTF-8") from error
    except OSError as error:
        raise _Unreadable(error.strerror or str(error)) from error


@lru_cache(maxsize=1)
def _snapshot() -> Mapping[str, str]:
    text = Path(__file__).with_name("jazzy.json").read_text(encoding="utf-8")
    definitions: Mapping[str, str] = json.loads(text)
    return definitions


def read_description(name: str, text: str) -> Interface:
    """Return the interface ``name`` from a type description.

    Raises ValueError when the text is not one, or uses a type that ROS 2 messages do not have.
    """
    try:
        description = json.loads(text)["type_description_msg"]
        described = {
            item["type_name"]: item["fields"]
            for item in (
                *description["referenced_type_descriptions"],
                description["type_description"],
            )
        }
        return _interface(name, described)
    except (KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"not a type description: {error!r}") from None


def _interface(name: str, described: Mapping[str, list[Any]]) -> Interface:
    def part(suffix: str) -> Message:
        return Message(name + suffix, tuple(_fields(described[name + suffix])))

    return interface_of(name, part)


def _fields(described: list[Any]) -> list[Field]:
    return [
        Field(item["name"], _field_type(item["type"]), _default(item["default_value"]))
        for item in described
        if item["name"] != _PLACEHOLDER
    ]


def _field_type(described: Mapping[str, Any]) -> FieldType:
    row, number = divmod(described["type_id"], _ROW)
    name = described["nested_type_name"] if number == _NESTED else _TYPE_NAMES.get(number)
    if name is None or row > _UNBOUNDED_SEQUENCE:
        raise ValueError(f"type {described['type_id']} has no place in a message")
    return FieldType(
        name,
        is_array=row > 0,
        array_size=described["capacity"] if row == _FIXED_ARRAY else None,
        array_bound=described["capacity"] if row == _BOUNDED_SEQUENCE else None,
        string_bound=described["string_capacity"] or None,
    )


def _default(text: str) -> Plain:
    """Return a default, which the description spells as Python does."""
    if not text:
        return None
    try:
        value: Plain = ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text
    return value
