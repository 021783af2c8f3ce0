"""Where the files are that a system was put together from, and what they may refer to there."""

from __future__ import annotations

from collections.abc import Mapping as Map
from dataclasses import dataclass, field
from pathlib import Path

from composer.catalog import Catalog
from composer.project import Project
from composer.source import Span


@dataclass(frozen=True, slots=True)
class Places:
    """The folders of files, by what the files are called; ``home`` is that of the system's own.

    ``catalog`` is what the system's own file may refer to.
    """

    home: Path
    folders: Map[str, Path]
    catalog: Catalog
    _catalogs: dict[Path, Catalog] = field(default_factory=dict, repr=False, compare=False)

    def folder(self, span: Span) -> Path:
        """Return the folder of the file that something is written in."""
        return self.folders.get(span.file.path, self.home)

    def catalog_for(self, span: Span) -> Catalog:
        """Return the node types that may be used where something is written."""
        folder = self.folder(span)
        if folder == self.home:
            return self.catalog
        if folder not in self._catalogs:
            self._catalogs[folder] = Catalog.of(Project.at(folder))
        return self._catalogs[folder]
