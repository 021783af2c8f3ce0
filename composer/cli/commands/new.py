"""``compose new``: create a project, and files in it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from keyword import iskeyword
from pathlib import Path
from typing import Annotated

import typer

from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.new_files import write_files
from composer.cli.support.options import command_group, examples
from composer.cli.support.terminal import lines, say, write

new_app = command_group(
    """Create a project, or files in it.

    New files are valid, and systems and node types have a test. Existing files are not replaced.
    """
)

_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_RESERVED = frozenset({"test", "composer", "launch", "std_msgs"})

Name = Annotated[
    str,
    typer.Argument(
        metavar="NAME", help="Lower-case letters, digits and underscores, such as my_robot."
    ),
]


@new_app.command("project", epilog=examples("compose new project my_robot"))
def project(name: Name) -> None:
    """Create a project in a new folder.

    It has a system, a node type with a behavior, tests, and what colcon needs to build it.
    """
    from composer.bridges.scaffolding import new_project

    folder = Path(_checked(name))
    if folder.exists():
        raise CommandError(f"'{folder}' exists already", hint="choose another name")
    _create(folder, new_project(name))
    say(f"try: cd {name} && compose run systems/{name}.yaml")


@new_app.command("system", epilog=examples("compose new system arm"))
def system(name: Name) -> None:
    """Create a system and its test."""
    from composer.bridges.scaffolding import new_system

    _create(_root(), new_system(_checked(name)))


@new_app.command("node", epilog=examples("compose new node planner"))
def node(name: Name) -> None:
    """Create a node type with a behavior, and its test."""
    from composer.bridges.scaffolding import new_node

    root = _root()
    _create(root, new_node(_checked(name)))
    from composer.project.node_types import replaced_built_in_type

    if replaced_built_in_type(root / "nodes" / f"{name}.yaml") is not None:
        say(f"note: it replaces the built-in node type '{name}' in this project")


@new_app.command("interfaces", epilog=examples("compose new interfaces my_msgs"))
def interfaces(name: Name) -> None:
    """Create a package of messages, services and actions.

    Only its definitions and a short package.xml are needed: see 'compose interface build'.
    """
    from composer.bridges.scaffolding import new_interfaces
    from composer.interfaces.sources import Bundle, package_name

    root = _root()
    if name in Bundle().packages() or name == package_name(root / "package.xml"):
        raise _in_use(name)
    _create(root, new_interfaces(_checked(name)))
    say("next: compose interface build")


def _checked(name: str) -> str:
    """Return a name that ROS, Python and colcon accept. Raises UsageError."""
    if not _NAME.fullmatch(name):
        raise UsageError(
            f"'{name}' is not a valid name",
            hint="names have lower-case letters, digits and single underscores, such as my_robot",
        )
    if name in _RESERVED or iskeyword(name):
        raise _in_use(name)
    return name


def _in_use(name: str) -> UsageError:
    return UsageError(f"the name '{name}' is in use", hint="choose another one")


def _root() -> Path:
    from composer.project import Project

    return Project.at(Path.cwd()).root


def _create(root: Path, files: Mapping[str, str]) -> None:
    write_files(root, files, replace=None)
    write(lines(_shown(root / path) for path in files))


def _shown(path: Path) -> str:
    try:
        return str(path.absolute().relative_to(Path.cwd()))
    except ValueError:
        return str(path)
