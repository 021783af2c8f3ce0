"""``compose interface``: message, service and action types. ROS is not needed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.support.completion import complete_type
from composer.cli.support.errors import CommandError
from composer.cli.support.options import Json, examples
from composer.cli.support.output import as_json
from composer.cli.support.terminal import lines, write

if TYPE_CHECKING:
    from composer.interfaces import Interfaces, Message

app = typer.Typer(
    help="""Show message, service and action types.

    These are the types of installed packages and of the project, and the common types of ROS 2. ROS
    is not needed.
    """,
    epilog=examples(
        "compose interface list --only-srvs", "compose interface show nav_msgs/msg/Odometry"
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


@app.command("list", epilog=examples("compose interface list", "compose interface list -s"))
def list_interfaces(
    *,
    only_messages: Annotated[
        bool, typer.Option("--only-msgs", "-m", help="List messages.")
    ] = False,
    only_services: Annotated[
        bool, typer.Option("--only-srvs", "-s", help="List services.")
    ] = False,
    only_actions: Annotated[
        bool, typer.Option("--only-actions", "-a", help="List actions.")
    ] = False,
    json: Json = False,
) -> None:
    """List the known types."""
    only = {"msg": only_messages, "srv": only_services, "action": only_actions}
    interfaces = _interfaces()
    folders = [folder for folder, chosen in only.items() if chosen or not any(only.values())]
    names = [name for folder in folders for name in interfaces.names(folder)]
    if json:
        write(as_json(names, indent=2))
    elif names:
        write(lines(names))


@app.command(
    "show",
    epilog=examples(
        "compose interface show nav_msgs/msg/Odometry",
        "compose interface show composer_interfaces/action/Navigate --flat",
    ),
)
def show(
    name: Type,
    *,
    flat: Annotated[bool, typer.Option("--flat", help="Do not expand nested messages.")] = False,
    json: Json = False,
) -> None:
    """Print the definition of a type.

    Nested messages are expanded and indented.
    """
    from composer.interfaces.index import similar_interface

    interfaces = _interfaces()
    found = interfaces.find(name)
    problem = interfaces.problem(name)
    if problem is not None:
        raise CommandError(str(problem), hint=f"see {problem.place}")
    if found is None:
        known = [item for folder in ("msg", "srv", "action") for item in interfaces.names(folder)]
        raise CommandError(f"there is no type '{name}'", hint=similar_interface(name, known))
    if json:
        parts = {title: _as_data(part) for title, part in _parts(found).items()}
        write(as_json({"name": name, **parts}, indent=2))
        return
    parts_shown = (_lines_of(part, interfaces, flat) for part in _parts(found).values())
    write("\n---\n".join(parts_shown))


def _interfaces() -> Interfaces:
    from composer.interfaces import Interfaces
    from composer.node_types import interface_folders
    from composer.project import Project

    return Interfaces.load(interface_folders(Project.at(Path.cwd())))


def _parts(found: Any) -> dict[str, Message]:
    from composer.interfaces import Action, Service

    match found:
        case Service():
            return {"request": found.request, "response": found.response}
        case Action():
            return {"goal": found.goal, "result": found.result, "feedback": found.feedback}
        case _:
            return {"message": found}


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


def _lines_of(message: Message, interfaces: Interfaces, flat: bool, indent: str = "") -> str:
    from composer.interfaces import Message

    shown = [f"{indent}{item.type} {item.name}={item.value}" for item in message.constants]
    for field in message.fields:
        default = "" if field.default is None else f" {field.default}"
        shown.append(f"{indent}{field.type} {field.name}{default}")
        inner = None if flat or field.type.is_primitive else interfaces.find(field.type.name)
        if isinstance(inner, Message) and inner.fields:
            shown.append(_lines_of(inner, interfaces, flat, indent + "  "))
    return "\n".join(shown)
