"""``compose stubs``: types of messages, ports and parameters, for editors."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.base.characters import counted
from composer.base.fast_dataclass import dataclass
from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.options import examples
from composer.cli.support.system_arguments import check_exists
from composer.cli.support.terminal import lines, say, write

if TYPE_CHECKING:
    from composer.loading.reported import LoadResult
    from composer.project import Project
    from composer.python_code.stubs.behaviors import NamedNode
    from composer.python_code.stubs.folder import FolderChanges


EPILOG = examples(
    "compose stubs                    write 'typings' in the root of the project",
    "compose stubs --check            fail if it is out of date, for CI",
    "compose stubs -o build/typings   write another folder",
    "compose stubs ../other_robot     write the stubs of another project",
)


def stubs(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[PATH]...",
            help="Systems, or folders with systems. Default: the project of the current folder.",
        ),
    ] = None,
    *,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FOLDER",
            help="Write to this folder. Default: 'typings' in the root of the project.",
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; exit with code 1 if it would change.")
    ] = False,
) -> None:
    """Write type stubs for editors and type checkers.

    They describe all messages, services and actions, rclpy, and for each node type a base class
    with its ports, parameters and handlers. A behavior of node type 'planner' uses its class with
    one line:

      from composer.typed import PlannerBehavior

    Pylance, pyright and basedpyright read the folder 'typings' without a setting. For pyrefly, set
    'search-path', for ty 'environment.extra-paths', for mypy 'mypy_path' to it.

    'compose validate' and 'compose run' update 'typings' once it exists. They replace and remove
    only files that one of these commands has written.
    """
    from composer.base.source import shown_path
    from composer.python_code.stubs.folder import TYPINGS, folder_changes

    project = _project(paths or ())
    found = _project_stubs(project, paths or ())
    if not found.files and not project.is_declared:
        raise UsageError(
            f"there is no system and no node type in '{project.root}'",
            hint="compose new project NAME creates a project",
        )
    folder = project.root / TYPINGS if output is None else output
    shown = shown_path(folder)
    try:
        changes = folder_changes(folder, found.stubs)
    except OSError as error:
        raise CommandError(f"cannot read '{shown}': {error.strerror}") from error
    for note in found.notes:
        say(f"note: {note}")
    for name in changes.kept:
        say(f"note: '{shown}/{name}' is not a file of this command: it is kept")
    changed = (*changes.outdated, *changes.obsolete)
    if not changed:
        say(f"'{shown}' is up to date")
    elif check:
        write(lines(f"{shown}/{name}" for name in sorted(changed)))
        option = "" if output is None else f" -o {shown}"
        raise CommandError(f"'{shown}' is out of date", hint=f"run 'compose stubs{option}'")
    else:
        _write_changes(folder, changes)
        say(f"'{shown}': {_counted(changes)}")


def _project(paths: Sequence[Path]) -> Project:
    """Return the project of all paths, by default the project of the current folder."""
    from composer.project import Project

    folders = list(map(_folder, paths)) or [Path.cwd()]
    projects = {project.root: project for project in map(Project.at, folders)}
    if len(projects) > 1:
        raise UsageError(
            "these files belong to several projects: " + ", ".join(map(str, sorted(projects))),
            hint="write the stubs of each project with a command of its own",
        )
    return next(iter(projects.values()))


def _folder(path: Path) -> Path:
    """Return a folder, or the folder of a file. Raises UsageError."""
    check_exists(path)
    try:
        return path if path.is_dir() else path.resolve().parent
    except (OSError, RuntimeError, ValueError) as error:
        raise UsageError(f"'{path}' cannot be read") from error


@dataclass(frozen=True, slots=True)
class _ProjectStubs:
    """The stubs of a project, by their paths in the folder.

    ``files`` is the number of systems and node types. ``notes`` are about nodes that get no class;
    without ``is_complete``, the file of a node type cannot be read.
    """

    stubs: dict[str, str]
    files: int
    notes: tuple[str, ...]
    is_complete: bool


def _project_stubs(project: Project, paths: Sequence[Path] = ()) -> _ProjectStubs:
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
    return _ProjectStubs(stub_files(classes, interfaces), len(results), notes, not unreadable)


def _write_changes(folder: Path, changes: FolderChanges) -> None:
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
    from composer.base.folders import TrustedUsers
    from composer.base.source import shown_path
    from composer.python_code.stubs.folder import TYPINGS, folder_changes, has_stubs

    folder = project.root / TYPINGS
    try:
        if not has_stubs(folder) or not project.holds(folder):
            return
        found = _project_stubs(project)
        if not found.is_complete or TrustedUsers.own().other_owner(folder) is not None:
            return
        changes = folder_changes(folder, found.stubs)
        if changes.outdated or changes.obsolete:
            _write_changes(folder, changes)
            say(f"'{shown_path(folder)}' is up to date again: {_counted(changes)}")
    except OSError as error:
        say(f"note: '{shown_path(folder)}' was not updated: {error.strerror}")
    except CommandError as error:
        say(f"note: '{shown_path(folder)}' was not updated: {error.message}")


def _counted(changes: FolderChanges) -> str:
    """Return how many files have changed."""
    removed = f", {len(changes.obsolete)} removed" if changes.obsolete else ""
    return f"{counted(len(changes.outdated), 'file')} written{removed}"


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
