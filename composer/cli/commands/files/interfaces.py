"""``compose interfaces``: the interface packages of the project."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from composer.cli.support.errors import FAILED, CommandError
from composer.cli.support.options import examples
from composer.cli.support.output.terminal import lines, say_raw, use_color, write

app = typer.Typer(
    help="""Build the interface packages of the project.

    To show types, use 'compose interface'.
    """,
    epilog=examples("compose interfaces build"),
    no_args_is_help=True,
    rich_markup_mode=None,
)


@app.callback()
def interfaces() -> None:
    """Build the interface packages of the project.

    To show types, use 'compose interface'.
    """


@app.command(
    "build",
    epilog=examples(
        "compose interfaces build",
        "compose interfaces build my_msgs",
        "compose interfaces build tf2_msgs                            a package of ROS",
        "compose interfaces build my_msgs --generate src/my_msgs      a package for colcon",
    ),
)
def build(
    packages: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[PACKAGE]...",
            help="By default, all packages of the project.",
            show_default=False,
        ),
    ] = None,
    *,
    generate: Annotated[
        Path | None,
        typer.Option(
            "--generate",
            metavar="FOLDER",
            help="Only write the complete package to this new folder.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Build interface packages and install them for this Python.

    A package is a folder in 'interfaces' with the .msg, .srv and .action files in 'msg', 'srv' and
    'action', and a package.xml that names it. The rest is generated in 'build/interfaces', and pip
    builds it, with gcc. Packages that have a pyproject.toml of their own are built as they are.

    tf2_msgs, control_msgs and other packages of ROS that are not on PyPI are built by their names,
    from the definitions that come with the composer.

    Building needs ROS 2 from PyPI. With a sourced ROS 2, and for packages with types of another one
    that is not on PyPI, such as nav2_msgs, build the generated package with colcon.
    """
    from composer.cli.support.interface_builds import complete_package, install_package
    from composer.project import Project

    project = Project.at(Path.cwd())
    found = _found(project.interface_folders, packages or [], install=generate is None)
    _check(project.interface_folders, found)
    if generate is not None:
        if generate.exists():
            raise CommandError(f"'{generate}' exists already", hint="choose a new folder")
        if len(found) != 1:
            raise CommandError("name one package", hint=f"packages: {', '.join(found)}")
        ((name, folder),) = found.items()
        complete_package(name, folder, generate, for_pip=False)
        write(lines([f"{name}: {generate}"]))
        return
    for name, folder in found.items():
        source = folder or Path()
        if folder is None or not (folder / "pyproject.toml").is_file():
            source = project.root / "build" / "interfaces" / name
            complete_package(name, folder, source)
        install_package(name, source)
        write(lines([f"{name}: installed"]))


def _check(folders: tuple[Path, ...], packages: dict[str, Path | None]) -> None:
    """Check the definitions of the packages as 'compose validate' does. Raises typer.Exit."""
    from composer.interfaces import Interfaces
    from composer.report.text import render
    from composer.rules.interfaces import invalid_definitions

    own = [name for name, folder in packages.items() if folder is not None]
    diagnostics = list(invalid_definitions(Interfaces.load(folders), own))
    if diagnostics:
        say_raw(render(diagnostics, color=use_color(sys.stderr)))
        raise typer.Exit(FAILED)


def _found(
    folders: tuple[Path, ...], packages: list[str], *, install: bool
) -> dict[str, Path | None]:
    """Return the folders of packages by their names; None for those of ROS. Raises CommandError."""
    from composer.base.diagnostics import suggestion
    from composer.interfaces.sources import Bundle, find_packages, installed_prefixes

    known: dict[str, Path | None] = dict(find_packages(folders).folders)
    bundled = Bundle().packages() - known.keys()
    for name in bundled.intersection(packages):
        if install and any(prefix.has_package(name) for prefix in installed_prefixes()):
            raise CommandError(f"package '{name}' is installed already")
        known[name] = None
    if not known and not packages:
        raise CommandError(
            "the project has no interface package",
            hint="compose new interfaces NAME creates one",
        )
    for name in packages:
        if name not in known:
            raise CommandError(
                f"the project has no interface package '{name}', and the composer has none",
                hint=suggestion(name, {*known, *bundled}),
            )
    return {name: known[name] for name in packages or known}
