"""Finds and reads the files of Python modules, without importing them or their parents."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import io
import os
import sys
import tokenize
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from composer.base.diagnostics import nearest
from composer.base.fast_dataclass import dataclass
from composer.base.files import FileTooLargeError, NotRegularError, read_regular
from composer.base.folders import TrustedUsers
from composer.base.source import Span
from composer.project import Project

MAXIMUM_BYTES = 250_000
PYTHON_SUFFIX = ".py"
#: Files of these types in a package may be modules that are compiled when it is built.
_COMPILED = (".c", ".cpp", ".pyx", ".pyd", ".so")

#: Other codecs of Python may take quadratic time, or do not encode text.
_ENCODINGS = frozenset({"utf-8", "utf-8-sig", "ascii", "us-ascii", "iso-8859-1", "iso-8859-15"})


class Unreadable(Exception):
    """The file of a module cannot be read as Python; the message is the reason.

    ``span`` is the location of an error in the text.
    """

    def __init__(self, message: str, span: Span | None = None) -> None:
        super().__init__(message)
        self.span = span


def module_origin(module: str, folder: Path, project: Project) -> Path | None:
    """Return the file of ``module``, a dotted name, or None.

    Searches next to the YAML file (``folder``), in the node type folders of its project, and on
    Python's module search path. The suffix of a compiled or built-in module is not PYTHON_SUFFIX.
    Raises Unreadable for a symbolic link out of the project and for a file of another user.
    """
    parts = module.split(".")
    if not all(part.isidentifier() for part in parts):
        return None
    return local_module_file(module, folder, project) or _installed(parts)


def module_file(module: str, folder: Path, project: Project) -> Path | None:
    """Return the Python file of ``module``, as :func:`module_origin` finds it, or None."""
    found = module_origin(module, folder, project)
    return found if found is not None and found.suffix == PYTHON_SUFFIX else None


def local_module_file(module: str, folder: Path, project: Project) -> Path | None:
    """Return the file of ``module`` next to the YAML file or among the node types, or None.

    Raises Unreadable as :func:`module_file`.
    """
    parts = module.split(".")
    for base in dict.fromkeys((folder, *project.node_folders)):
        file = base.joinpath(*parts).with_suffix(".py")  # the one that the runtime loads
        found = file if _exists(file) else module_below(base, parts)
        if found is not None:
            return _checked(found, project)
    return None


def relative_module_file(module: str, level: int, importer: Path) -> Path | None:
    """Return the file of ``from ...module import`` with ``level`` dots, written in ``importer``."""
    base = importer.parent
    for _ in range(level - 1):
        base = base.parent
    return module_below(base, module.split(".") if module else [])


def read_text(path: Path) -> str:
    """Return the text of a Python file, by its declared encoding. Raises Unreadable."""
    try:
        content = read_regular(path, MAXIMUM_BYTES)
    except NotRegularError:
        raise Unreadable("is not a regular file") from None
    except FileTooLargeError:
        raise Unreadable(f"is larger than {MAXIMUM_BYTES} bytes") from None
    except OSError as error:
        raise Unreadable(f"cannot be read: {error.strerror}") from None
    try:
        encoding, _ = tokenize.detect_encoding(io.BytesIO(content).readline)
        if encoding not in _ENCODINGS:
            raise Unreadable(f"has the encoding '{encoding[:40]}'; use UTF-8")
        return content.decode(encoding)
    except (SyntaxError, UnicodeError):
        raise Unreadable("is not text in the encoding it declares") from None


def module_below(
    base: Path, parts: Sequence[str], suffixes: Iterable[str] = (".py",)
) -> Path | None:
    """Return the file of the module with the given parts of its name, in a folder."""
    path = base.joinpath(*parts)
    candidates = [path / "__init__.py"]
    if parts:
        candidates += (path.with_name(f"{path.name}{suffix}") for suffix in suffixes)
    return next((file for file in candidates if _exists(file)), None)


def _checked(path: Path, project: Project) -> Path:
    if not project.holds(path):
        raise Unreadable("is a symbolic link out of the project")
    if TrustedUsers.starting_at(project.folder).other_owner(path) is not None:
        raise Unreadable("belongs to another user")
    return path


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _installed(parts: list[str]) -> Path | None:
    """Return the file of an installed module; one that is built in has an empty name."""
    spec = module_spec(parts[0])
    if spec is None:
        return None
    if len(parts) == 1:
        return Path((spec.origin or "") if spec.has_location else "")
    suffixes = (".py", *importlib.machinery.EXTENSION_SUFFIXES)
    folders = spec.submodule_search_locations or ()
    files = (module_below(Path(folder), parts[1:], suffixes) for folder in folders)
    return next(filter(None, files), None)


def module_spec(name: str) -> importlib.machinery.ModuleSpec | None:
    """Return the spec of a top-level module, without importing it."""
    try:
        return importlib.util.find_spec(name)
    except Exception:  # import hooks of installed packages may raise anything
        return None


@dataclass(frozen=True, slots=True)
class NearbyModules:
    """The modules next to one that does not exist.

    ``package`` is the longest part of its name that is a package, ``missing`` the part that
    follows. ``names`` are the modules next to that part.
    """

    package: str
    missing: str
    names: Sequence[str]

    @property
    def similar(self) -> str | None:
        """The module that was most likely meant."""
        return nearest(self.missing, self.names)

    @property
    def hint(self) -> str | None:
        """The name that was most likely meant, as a hint; also one that is installed.

        Python's own modules have no classes of nodes.
        """
        installed = () if self.package else _installed_modules(tuple(sys.path))
        close = self.similar or nearest(self.missing, installed)
        return f"did you mean '{close}'?" if close is not None else None


@lru_cache(maxsize=1)  # for hints, a module that was installed meanwhile may be missing
def _installed_modules(search_path: tuple[str, ...]) -> tuple[str, ...]:
    names = _modules_in(map(Path, search_path))
    return tuple(name for name in names if name not in sys.stdlib_module_names)


def nearby_modules(module: str, folders: Iterable[Path]) -> NearbyModules:
    """Look for what is next to ``module``, a dotted name that no file has, in some folders."""
    parts, bases, package = module.split("."), [*dict.fromkeys(folders)], 0
    places = bases
    for count in range(1, len(parts)):
        inner = [*_package_folders(parts[:count], bases)]
        if inner:
            places, package = inner, count
    return NearbyModules(".".join(parts[:package]), parts[package], [*_modules_in(places)])


def _modules_in(folders: Iterable[Path]) -> Iterator[str]:
    """Yield the names of the files and folders that may be modules."""
    for folder in folders:
        with suppress(OSError, ValueError):
            for entry in os.listdir(folder):  # noqa: PTH208 - it takes a tenth of Path.iterdir
                name, _, rest = entry.partition(".")
                is_module = entry.endswith((".py", ".pyi", *_COMPILED)) or not rest
                if is_module and name.isidentifier():
                    yield name


def _package_folders(parts: list[str], bases: Iterable[Path]) -> Iterator[Path]:
    spec = module_spec(parts[0])
    locations = () if spec is None else spec.submodule_search_locations or ()
    candidates = [base.joinpath(*parts) for base in bases]
    candidates += [Path(location, *parts[1:]) for location in locations]
    for candidate in candidates:
        with suppress(OSError, ValueError):
            if candidate.is_dir():
                yield candidate
