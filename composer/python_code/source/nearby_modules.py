"""The modules that a misspelled name may have meant, found without importing anything."""

from __future__ import annotations

import pkgutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from composer.fast_dataclass import dataclass
from composer.project import Project
from composer.python_code.source.modules import module_spec
from composer.spelling import Vocabulary

_MAXIMUM_FILES = 2000


@dataclass(frozen=True, slots=True)
class NearbyModules:
    """The modules next to one that does not exist.

    ``package`` is the longest part of its name that is a package, ``missing`` the part that follows
    it; ``is_single``: the name has one part. ``names`` are the modules of that package;
    without a package, those of the project. ``installed`` are then the other modules that can be
    imported.
    """

    package: str
    missing: str
    names: tuple[str, ...]
    is_single: bool = False
    installed: tuple[str, ...] = ()

    @property
    def is_misspelled(self) -> bool:
        """Whether another name was most likely meant: the module is not just not installed.

        A file of the project has a name without dots, unlike most modules of ROS packages.
        """
        return bool(self.package) or (self.is_single and self._similar is not None)

    @property
    def _similar(self) -> str | None:
        return _closest(self.missing, self.names)

    @property
    def hint(self) -> str | None:
        """The name that was most likely meant, as a hint."""
        name = self._similar or _closest(self.missing, self.installed)
        return None if name is None else f"did you mean '{name}'?"


def nearby_modules(module: str, folder: Path, project: Project) -> NearbyModules:
    """Look for what is next to ``module``, a dotted name that no file has."""
    parts = module.split(".")
    bases = tuple(dict.fromkeys((folder, *project.node_folders)))
    for count in range(len(parts) - 1, 0, -1):
        folders = tuple(_package_folders(parts[:count], bases))
        if folders:
            return NearbyModules(".".join(parts[:count]), parts[count], _modules_in(folders))
    installed = _installed_names(tuple(sys.path))
    return NearbyModules("", parts[0], _modules_in(bases), len(parts) == 1, installed)


@lru_cache(maxsize=1)
def _installed_names(path: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(item.name for item in pkgutil.iter_modules(path))


def _closest(name: str, names: tuple[str, ...]) -> str | None:
    return next(iter(Vocabulary(names).close(name)), None)


def _package_folders(parts: list[str], bases: Iterable[Path]) -> Iterator[Path]:
    spec = module_spec(parts[0])
    locations = () if spec is None else spec.submodule_search_locations or ()
    candidates = [base.joinpath(*parts) for base in bases]
    candidates += [Path(location, *parts[1:]) for location in locations]
    for candidate in candidates:
        with suppress(OSError, ValueError):
            if candidate.is_dir():
                yield candidate


def _modules_in(folders: Iterable[Path]) -> tuple[str, ...]:
    found = set()
    for folder in folders:
        with suppress(OSError):
            for _, path in zip(range(_MAXIMUM_FILES), folder.iterdir(), strict=False):
                name = path.name.partition(".")[0]
                is_module = path.suffix in (".py", ".so") or (path / "__init__.py").is_file()
                if is_module and name.isidentifier() and name != "__init__":
                    found.add(name)
    return tuple(sorted(found))
