"""``compose interface``: message, service and action types, and the packages of the project."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.support.completion import complete_interface_package, complete_type
from composer.cli.support.errors import FAILED, CommandError
from composer.cli.support.options import Json, command_group, examples
from composer.cli.support.terminal import as_json, lines, say, say_raw, use_color, write

if TYPE_CHECKING:
    from composer.interfaces import Interface, Interfaces, Message

_WHEEL_PREFIX = "ros-"

interface_app = command_group(
    """Show interface types, and build interface packages.

    Types come from installed packages, from the project, and from the common packages of ROS 2. To
    list and show types, ROS is not needed.
    """
)


@interface_app.command(
    "list", epilog=examples("compose interface list", "compose interface list std_srvs")
)
def list_interfaces(
    package: Annotated[
        str | None,
        typer.Argument(
            metavar="[PACKAGE]",
            help="Only the types of this package.",
            autocompletion=complete_interface_package,
        ),
    ] = None,
    *,
    json: Json = False,
) -> None:
    """List all types, or the types of a package."""
    from composer.base.diagnostics import suggestion

    names = list(_interfaces().names())
    packages = {name.partition("/")[0] for name in names}
    if package is not None and package not in packages:
        raise CommandError(
            f"there is no package '{package}' with types", hint=suggestion(package, packages)
        )
    if package is not None:
        names = [name for name in names if name.startswith(f"{package}/")]
    write(as_json(names, indent=2) if json else lines(names))


@interface_app.command(
    "show",
    epilog=examples(
        "compose interface show nav_msgs/msg/Odometry",
        "compose interface show composer_interfaces/action/Navigate --no-comments",
    ),
)
def show(
    name: Annotated[
        str,
        typer.Argument(
            metavar="TYPE", help="Such as std_msgs/msg/String.", autocompletion=complete_type
        ),
    ],
    *,
    no_comments: Annotated[
        bool, typer.Option("--no-comments", help="Show no comments and no empty lines.")
    ] = False,
    json: Json = False,
) -> None:
    """Print the definition of a type.

    Nested messages are expanded and indented, without their comments.
    """
    from composer.interfaces import parts
    from composer.interfaces.index import listing

    interfaces = _interfaces()
    definition = _find(interfaces, name)
    if json:
        data = {title: _as_data(part) for title, part in parts(definition).items()}
        write(as_json({"name": name, **data}, indent=2))
        return
    write("\n".join(listing(name, interfaces, comments=not no_comments)))


@interface_app.command(
    "build",
    epilog=examples(
        "compose interface build",
        "compose interface build my_msgs",
        "compose interface build tf2_msgs                            a package of ROS",
        "compose interface build my_msgs --generate src/my_msgs      a package for colcon",
    ),
)
def build(
    packages: Annotated[
        list[str] | None,
        typer.Argument(metavar="[PACKAGE]...", help="By default, all packages of the project."),
    ] = None,
    *,
    generate: Annotated[
        Path | None,
        typer.Option(
            "--generate",
            metavar="FOLDER",
            help="Only write the complete package to this new folder.",
        ),
    ] = None,
) -> None:
    """Build interface packages and install them for this Python.

    A package is a folder in 'interfaces' with the .msg, .srv and .action files in 'msg', 'srv' and
    'action', and a package.xml that names it. The rest is generated in 'build/interfaces', and pip
    builds it, with gcc. Packages that have a pyproject.toml of their own are built as they are.

    tf2_msgs, control_msgs and other packages of ROS that are not on PyPI are built by their names,
    from the definitions that come with the composer.

    Building needs ROS 2 from PyPI. Use --generate and colcon with a sourced ROS 2, and for a
    package that uses types of another package that is not on PyPI, such as nav2_msgs.
    """
    from composer.project import Project

    project = Project.at(Path.cwd())
    chosen = _chosen(project.interface_folders, packages or [], install=generate is None)
    _check(project.interface_folders, chosen)
    if generate is not None:
        if generate.exists():
            raise CommandError(f"'{generate}' exists already", hint="choose a new folder")
        if len(chosen) != 1:
            raise CommandError("name one package", hint=f"packages: {', '.join(chosen)}")
        ((name, folder),) = chosen.items()
        complete_package(name, folder, generate, for_pip=False)
        write(lines([f"{name}: {generate}"]))
        return
    for name, folder in chosen.items():
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
    from composer.rules.ports import invalid_definitions

    own = [name for name, folder in packages.items() if folder is not None]
    diagnostics = list(invalid_definitions(Interfaces.load(folders), own))
    if diagnostics:
        say_raw(render(diagnostics, color=use_color(sys.stderr)))
        raise typer.Exit(FAILED)


def _chosen(
    folders: tuple[Path, ...], packages: list[str], *, install: bool
) -> dict[str, Path | None]:
    """Return the folders of packages by name; None for packages of ROS. Raises CommandError."""
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
            "the project has no interface package", hint="compose new interfaces NAME creates one"
        )
    for name in packages:
        if name not in known:
            raise CommandError(
                f"the project has no interface package '{name}', and the composer has none",
                hint=suggestion(name, {*known, *bundled}),
            )
    return {name: known[name] for name in packages or known}


def _interfaces() -> Interfaces:
    from composer.interfaces import Interfaces
    from composer.project import Project
    from composer.project.node_types import interface_folders

    return Interfaces.load(interface_folders(Project.at(Path.cwd())))


def _find(interfaces: Interfaces, name: str) -> Interface:
    """Return an interface. Raises CommandError."""
    from composer.interfaces.index import similar_interface

    found = interfaces.find(name)
    problem = interfaces.problem(name)
    if problem is not None:
        raise CommandError(str(problem), hint=f"see {problem.place}")
    if found is None:
        raise CommandError(
            f"there is no type '{name}'", hint=similar_interface(name, interfaces.names())
        )
    return found


def _as_data(message: Message) -> dict[str, Any]:
    """Return the fields and constants; nested messages are not expanded."""
    return {
        "fields": [
            {"name": field.name, "type": str(field.type), "default": field.default}
            for field in message.fields
        ],
        "constants": [
            {"name": item.name, "type": str(item.type), "value": item.value}
            for item in message.constants
        ],
    }


def wheel_versions() -> dict[str, str]:
    """Return the versions of the ROS packages that pip has installed, by their ROS names."""
    from importlib.metadata import distributions

    found = {}
    for item in distributions():
        name = item.metadata["Name"] or ""
        if name.startswith(_WHEEL_PREFIX):
            found[name.removeprefix(_WHEEL_PREFIX).replace("-", "_")] = item.version
    return found


def complete_package(name: str, folder: Path | None, target: Path, *, for_pip: bool = True) -> None:
    """Write the complete package to ``target``, which is replaced as a whole. Raises CommandError.

    Without a folder, it is a package of ROS whose definitions come with the composer. Unless it has
    to be built with pip, what pip needs may be left out.
    """
    from composer.bridges import scaffolding

    try:
        package = (
            scaffolding.bundled_package(name)
            if folder is None
            else scaffolding.read_package(name, folder)
        )
        try:
            files = package.files(wheel_versions())
        except scaffolding.NotForPip as error:
            if for_pip:
                hint = f"build it with colcon: compose interface build {name} --generate FOLDER"
                raise CommandError(str(error), hint=hint) from error
            files = package.files(None)
        _replace_folder(target, files)
    except scaffolding.InvalidPackage as error:
        raise CommandError(str(error)) from error
    except (OSError, UnicodeDecodeError) as error:
        raise CommandError(f"cannot complete package '{name}': {error}") from error


def _replace_folder(target: Path, files: Mapping[str, str]) -> None:
    """Write files to a folder, which is as before if that fails. Raises OSError."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.name}.") as temporary:
        new, old = Path(temporary, "new"), Path(temporary, "old")
        new.mkdir()
        for path, text in files.items():
            file = new / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        if target.exists():
            target.rename(old)
        try:
            new.rename(target)
        except OSError:
            if old.exists():
                old.rename(target)
            raise


def install_package(name: str, folder: Path) -> None:
    """Build a complete package with pip, and install it for this Python. Raises CommandError."""
    if "rclpy" not in wheel_versions():
        raise CommandError(
            "pip can build interfaces only where ROS 2 is installed from PyPI",
            hint=f"colcon build --base-paths {folder}",
        )
    say(f"building {name}, which takes up to a minute")
    done = subprocess.run(  # noqa: S603 - this very Python
        [
            sys.executable,
            "-m",
            "pip",
            "install",
            "--quiet",
            "--no-deps",
            "--force-reinstall",
            folder,
        ],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode != 0:
        say(done.stdout + done.stderr)
        raise CommandError(f"package '{name}' was not built", hint="see the output of pip above")
