"""``compose export stubs``: the types of messages, ports and parameters, for editors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.options import examples
from composer.cli.support.output.terminal import lines, say, write
from composer.cli.support.system_arguments import path_exists

if TYPE_CHECKING:
    from composer.project import Project


def add_stubs_command(app: typer.Typer) -> None:
    """Add the command to ``compose export``."""
    epilog = examples(
        "compose export stubs                    write 'typings' in the root of the project",
        "compose export stubs --check            fail if it is out of date, for CI",
        "compose export stubs -o build/typings   write another folder",
        "compose export stubs ../other_robot     write the stubs of another project",
    )
    app.command("stubs", epilog=epilog)(stubs)


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

    'compose validate' and 'compose run' update 'typings' once it exists. Files that this command
    has not written are neither replaced nor removed.
    """
    from composer.base.source import shown_path
    from composer.cli.support.typings import counted, project_stubs, write_changes
    from composer.python_code.stubs.folder import TYPINGS, folder_changes

    project = _project(paths or ())
    found = project_stubs(project, paths or ())
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
        raise CommandError(f"'{shown}' is out of date", hint=f"run 'compose export stubs{option}'")
    else:
        write_changes(folder, changes)
        say(f"'{shown}': {counted(changes)}")


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
    if not path_exists(path):
        raise UsageError(f"there is no file or folder '{path}'")
    try:
        return path if path.is_dir() else path.resolve().parent
    except (OSError, RuntimeError, ValueError) as error:
        raise UsageError(f"'{path}' cannot be read") from error
