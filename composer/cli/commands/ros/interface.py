"""``compose interface``: message, service and action types. ROS is not needed."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.support.completion import complete_interface_package, complete_type
from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.options import Json, examples
from composer.cli.support.output.results import as_json, as_yaml
from composer.cli.support.output.terminal import lines, write

if TYPE_CHECKING:
    from composer.interfaces import Interface, Interfaces, Message

app = typer.Typer(
    help="""Show message, service and action types.

    These are the types of installed packages and of the project, and the common types of ROS 2. ROS
    is not needed.
    """,
    epilog=examples(
        "compose interface list --only-srvs",
        "compose interface show nav_msgs/msg/Odometry",
        "compose interface proto geometry_msgs/msg/Twist",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

Type = Annotated[
    str,
    typer.Argument(
        metavar="TYPE", help="Such as std_msgs/msg/String.", autocompletion=complete_type
    ),
]
OnlyMessages = Annotated[bool, typer.Option("--only-msgs", "-m", help="Only messages.")]
OnlyServices = Annotated[bool, typer.Option("--only-srvs", "-s", help="Only services.")]
OnlyActions = Annotated[bool, typer.Option("--only-actions", "-a", help="Only actions.")]


@app.command("list", epilog=examples("compose interface list", "compose interface list -s"))
def list_interfaces(
    *,
    only_messages: OnlyMessages = False,
    only_services: OnlyServices = False,
    only_actions: OnlyActions = False,
    json: Json = False,
) -> None:
    """List the known types."""
    _print(_names(_interfaces(), only_messages, only_services, only_actions), json)


@app.command("packages", epilog=examples("compose interface packages --only-actions"))
def list_packages(
    *,
    only_messages: OnlyMessages = False,
    only_services: OnlyServices = False,
    only_actions: OnlyActions = False,
    json: Json = False,
) -> None:
    """List the packages that define types."""
    from composer.interfaces.listing import packages

    _print(packages(_names(_interfaces(), only_messages, only_services, only_actions)), json)


@app.command("package", epilog=examples("compose interface package std_srvs"))
def list_package(
    package: Annotated[
        str, typer.Argument(metavar="PACKAGE", autocompletion=complete_interface_package)
    ],
    *,
    only_messages: OnlyMessages = False,
    only_services: OnlyServices = False,
    only_actions: OnlyActions = False,
    json: Json = False,
) -> None:
    """List the types of a package."""
    from composer.base.diagnostics import suggestion
    from composer.interfaces.listing import packages

    interfaces = _interfaces()
    known = packages(_names(interfaces))
    if package not in known:
        raise CommandError(
            f"there is no package '{package}' with types", hint=suggestion(package, known)
        )
    names = _names(interfaces, only_messages, only_services, only_actions)
    _print([name for name in names if name.startswith(f"{package}/")], json)


@app.command(
    "show",
    epilog=examples(
        "compose interface show nav_msgs/msg/Odometry",
        "compose interface show composer_interfaces/action/Navigate --flat",
        "compose topic type /sensor_data | compose interface show -",
    ),
)
def show(
    name: Annotated[
        str,
        typer.Argument(
            metavar="TYPE",
            help="Such as std_msgs/msg/String; - reads it from standard input.",
            autocompletion=complete_type,
        ),
    ],
    *,
    all_comments: Annotated[
        bool, typer.Option("--all-comments", help="Show the comments of nested messages too.")
    ] = False,
    no_comments: Annotated[
        bool, typer.Option("--no-comments", help="Show no comments and no empty lines.")
    ] = False,
    flat: Annotated[bool, typer.Option("--flat", help="Do not expand nested messages.")] = False,
    json: Json = False,
) -> None:
    """Print the definition of a type.

    Nested messages are expanded and indented, without their comments.
    """
    if all_comments and no_comments:
        raise UsageError("only one of --all-comments and --no-comments can be used")
    from composer.interfaces import parts
    from composer.interfaces.listing import ListingOptions, listing

    wanted = sys.stdin.readline().strip() if name == "-" else name
    interfaces = _interfaces()
    found = _find(interfaces, wanted)
    if json:
        data = {title: _as_data(part) for title, part in parts(found).items()}
        write(as_json({"name": wanted, **data}, indent=2))
        return
    options = ListingOptions(not no_comments, all_comments, nested=not flat)
    write("\n".join(listing(wanted, interfaces, options)))


@app.command(
    "proto",
    epilog=examples(
        "compose interface proto geometry_msgs/msg/Twist",
        "compose interface proto std_srvs/srv/SetBool --no-quotes",
    ),
)
def proto(
    name: Type,
    *,
    no_quotes: Annotated[
        bool, typer.Option("--no-quotes", help="Do not print quotes around the YAML.")
    ] = False,
    json: Json = False,
) -> None:
    """Print a message, request or goal with default values, as YAML."""
    from composer.interfaces import parts
    from composer.interfaces.listing import prototype

    interfaces = _interfaces()
    message = next(iter(parts(_find(interfaces, name)).values()))
    value = prototype(message, interfaces)
    if json:
        write(as_json(value, indent=2))
        return
    text = f"{as_yaml(value)}\n"
    write(text if no_quotes else f'"{text}"')


def _interfaces() -> Interfaces:
    from composer.interfaces import Interfaces
    from composer.project import Project
    from composer.project.node_types import interface_folders

    return Interfaces.load(interface_folders(Project.at(Path.cwd())))


def _names(
    interfaces: Interfaces,
    only_messages: bool = False,
    only_services: bool = False,
    only_actions: bool = False,
) -> list[str]:
    """Return the names of all types, or of those kinds that are chosen."""
    only = {"msg": only_messages, "srv": only_services, "action": only_actions}
    folders = [folder for folder, chosen in only.items() if chosen or not any(only.values())]
    return [name for folder in folders for name in interfaces.names(folder)]


def _print(names: Sequence[str], json: bool) -> None:
    if json:
        write(as_json(list(names), indent=2))
    elif names:
        write(lines(names))


def _find(interfaces: Interfaces, name: str) -> Interface:
    """Return an interface. Raises CommandError."""
    from composer.interfaces.index import similar_interface

    found = interfaces.find(name)
    problem = interfaces.problem(name)
    if problem is not None:
        raise CommandError(str(problem), hint=f"see {problem.place}")
    if found is None:
        raise CommandError(
            f"there is no type '{name}'", hint=similar_interface(name, _names(interfaces))
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
