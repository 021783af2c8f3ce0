"""The folders of a system's files, and the node types that they may use."""

from __future__ import annotations

from collections.abc import Mapping as Map
from dataclasses import field
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.project import Project
from composer.project.node_types import NodeTypes


@dataclass(frozen=True, slots=True)
class SourceFolders:
    """The folders of files by name; ``home`` and ``node_types`` belong to the system's file."""

    home: Path
    folders: Map[str, Path]
    node_types: NodeTypes
    _node_types_of: dict[Path, NodeTypes] = field(default_factory=dict, repr=False, compare=False)

    def folder(self, span: Span) -> Path:
        """Return the folder of the file of ``span``."""
        return self.folders.get(span.file.path, self.home)

    def node_types_for(self, span: Span) -> NodeTypes:
        """Return the node types that the file of ``span`` may use."""
        folder = self.folder(span)
        if folder == self.home:
            return self.node_types
        if folder not in self._node_types_of:
            self._node_types_of[folder] = NodeTypes.of(Project.at(folder))
        return self._node_types_of[folder]
