"""The modules that a misspelled name may have meant, found without importing anything."""

from __future__ import annotations

import pkgutil
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path

from composer.fast_dataclass import dataclass
from composer.project import Project
from composer.python_code.source.modules import module_spec
from composer.spelling import Vocabulary

_MAXIMUM_MODULES = 2000


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
        return bool(self.package) or (self.is_single and bool(self._similar))

    @property
    def hint(self) -> str | None:
        """The name that was most likely meant, as a hint."""
        close = self._similar or Vocabulary(self.installed).close(self.missing)
        return next((f"did you mean '{name}'?" for name in close), None)

    @property
    def _similar(self) -> Sequence[str]:
        return Vocabulary(self.names).close(self.missing)


def nearby_modules(module: str, folder: Path, project: Project) -> NearbyModules:
    """Look for what is next to ``module``, a dotted name that no file has."""
    parts = module.split(".")
    bases = tuple(dict.fromkeys((folder, *project.node_folders)))
    for count in range(len(parts) - 1, 0, -1):
        folders = tuple(_package_folders(parts[:count], bases))
        if folders:
            return NearbyModules(".".join(parts[:count]), parts[count], _modules_in(folders))
    installed = _modules_in(sys.path)
    return NearbyModules("", parts[0], _modules_in(bases), len(parts) == 1, installed)


def _package_folders(parts: list[str], bases: Iterable[Path]) -> Iterator[Path]:
    spec = module_spec(parts[0])
    locations = () if spec is None else spec.submodule_search_locations or ()
    candidates = [base.joinpath(*parts) for base in bases]
    candidates += [Path(location, *parts[1:]) for location in locations]
    for candidate in candidates:
        with suppress(OSError, ValueError):
            if candidate.is_dir():
                yield candidate


def _modules_in(folders: Iterable[Path | str]) -> tuple[str, ...]:
    modules = pkgutil.iter_modules(map(str, folders))
    return tuple(item.name for item in islice(modules, _MAXIMUM_MODULES))
