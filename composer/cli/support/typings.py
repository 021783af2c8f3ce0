"""The stubs of a project, from all of its files, and the folder that has them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from composer.base.fast_dataclass import dataclass
from composer.cli.support.errors import CommandError
from composer.cli.support.output.terminal import say

if TYPE_CHECKING:
    from composer.loading import LoadResult
    from composer.project import Project
    from composer.python_code.stubs.behaviors import NamedNode
    from composer.python_code.stubs.folder import FolderChanges


@dataclass(frozen=True, slots=True)
class ProjectStubs:
    """The stubs of a project, by their paths in the folder.

    ``files`` is the number of systems and node types. ``notes`` are about nodes that get no class;
    without ``is_complete``, the file of a node type cannot be read.
    """

    stubs: dict[str, str]
    files: int
    notes: tuple[str, ...]
    is_complete: bool


def project_stubs(project: Project, paths: Sequence[Path] = ()) -> ProjectStubs:
    """Return the stubs for the node types of a project, and for the systems in ``paths``.

    The default are the systems in the folder ``systems`` and in the root of the project.
    """
    from composer.interfaces import Interfaces
    from composer.loading import load_models
    from composer.project.files import find_files
    from composer.project.node_types import interface_folders
    from composer.python_code.stubs.behaviors import behavior_classes
    from composer.python_code.stubs.folder import stub_files

    found = find_files((*project.node_folders, *(paths or _system_paths(project)))).files
    places = {os.path.relpath(path.resolve(), project.root): path for path in sorted(found)}
    results = dict(zip(places, load_models(places.values()), strict=True))
    interfaces = next((result.interfaces for result in results.values()), None)
    interfaces = interfaces or Interfaces.load(interface_folders(project))
    order = sorted(results, key=lambda place: (not _is_node_type(results[place]), place))
    named = [node for place in order for node in _nodes(place, results[place])]
    classes, conflicts = behavior_classes(named, interfaces)
    unreadable = [
        place
        for place, path in places.items()
        if results[place].system is None and path.resolve().parent in project.node_folders
    ]
    notes = (
        *(f"'{place}' cannot be read: see 'compose validate'" for place in unreadable),
        *(
            f"'{other.name}' of '{other.place}' differs from '{first.name}' of '{first.place}', "
            "which has the class of that name"
            for first, other in conflicts
        ),
    )
    return ProjectStubs(stub_files(classes, interfaces), len(results), notes, not unreadable)


def write_changes(folder: Path, changes: FolderChanges) -> None:
    """Bring the folder up to date. Raises CommandError."""
    from composer.cli.support.new_files import write_files

    write_files(folder, changes.outdated, replace=True)
    for name in changes.obsolete:
        path = folder / name
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise CommandError(f"cannot remove '{path}': {error.strerror}") from error
        with suppress(OSError):  # not empty
            path.parent.rmdir()


def update_typings(project: Project) -> None:
    """Bring the stubs of a project up to date, if it has some; say so, or what prevents it."""
    from composer.base.ownership import TrustedUsers
    from composer.base.source import shown_path
    from composer.python_code.stubs.folder import TYPINGS, folder_changes, has_stubs

    folder = project.root / TYPINGS
    try:
        if not has_stubs(folder) or not project.holds(folder):
            return
        found = project_stubs(project)
        if not found.is_complete or TrustedUsers.own().other_owner(folder) is not None:
            return
        changes = folder_changes(folder, found.stubs)
        if changes.outdated or changes.obsolete:
            write_changes(folder, changes)
            say(f"'{shown_path(folder)}' is up to date again: {counted(changes)}")
    except OSError as error:
        say(f"note: '{shown_path(folder)}' was not updated: {error.strerror}")
    except CommandError as error:
        say(f"note: '{shown_path(folder)}' was not updated: {error.message}")


def counted(changes: FolderChanges) -> str:
    """Return how many files have changed."""
    removed = f", {len(changes.obsolete)} removed" if changes.obsolete else ""
    return f"{_files(len(changes.outdated))} written{removed}"


def _files(number: int) -> str:
    return f"{number} file{'' if number == 1 else 's'}"


def _system_paths(project: Project) -> Iterator[Path]:
    from composer.project import SETTINGS_FILE, SYSTEMS

    if (project.root / SYSTEMS).is_dir():
        yield project.root / SYSTEMS
    for path in project.root.glob("*.yaml"):
        if path.is_file() and path.name != SETTINGS_FILE and project.holds(path):
            yield path


def _is_node_type(result: LoadResult) -> bool:
    return result.system is not None and result.system.node_type


def _nodes(place: str, result: LoadResult) -> Iterator[NamedNode]:
    """Yield the node type in a file, or the nodes of a system that have a behavior themselves."""
    from composer.python_code.stubs.behaviors import NamedNode

    for node in () if result.system is None else result.system.nodes:
        if _is_node_type(result) or (node.type_name is None and node.behavior is not None):
            yield NamedNode(node.name.value, node, place)
