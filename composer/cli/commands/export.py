"""``compose export``: files for other tools, derived from a system."""

from __future__ import annotations

import os
import pwd
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.commands.export_images import Force, add_image_commands, exported_system
from composer.cli.support.errors import CommandError
from composer.cli.support.name_values import Arguments, declared_arguments
from composer.cli.support.new_files import write_and_say, write_output
from composer.cli.support.options import Namespace, NewFile, command_group, examples
from composer.cli.support.system_arguments import SystemName
from composer.cli.support.terminal import as_json, write

if TYPE_CHECKING:
    from composer.bridges.export.deployment import Service
    from composer.model import Host

export_app = command_group(
    """Write files for other tools.

    The files are derived from the systems and node types: export again after changes.
    """
)

NewPath = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="PATH",
        help="Write to a new file instead of stdout; to a folder if there are several files.",
    ),
]


@export_app.command(
    "launch", epilog=examples("compose export launch pipeline -o launch/pipeline.launch.py")
)
def export_launch(
    system: SystemName, arguments: Arguments = None, *, output: NewFile = None, force: Force = False
) -> None:
    """Write a launch file that runs a system.

    The arguments of the system become launch arguments, also those without a value. Other launch
    arguments set the namespace, simulated time and the log level. The launch ends with the system.
    To run a system from a launch file of your own, use the action ComposeSystem.
    """
    from composer.bridges.export.launch_file import launch_file

    declared, path, _ = exported_system(system, arguments, needs_values=False)
    text = launch_file(declared, declared_arguments(path), path, output)
    write_output(text, output, replace=force)


@export_app.command(
    "systemd",
    epilog=examples(
        "compose export systemd systems/robot.yaml -o robot.service",
        "compose export systemd robot --user -o ~/.config/systemd/user/robot.service",
        "compose export systemd robot -o units       a system with several processes",
    ),
)
def export_systemd(
    system: SystemName,
    arguments: Arguments = None,
    *,
    user: Annotated[
        bool, typer.Option("--user", help="For the service manager of a user, not of the system.")
    ] = False,
    output: NewPath = None,
    force: Force = False,
) -> None:
    """Write the systemd units that run a system.

    Each process of the system becomes a service. The service runs as you, in this Python
    environment, with the ROS variables that are set now. If a process fails, systemd starts it
    again as the system declares. The services of several processes belong to a target.
    """
    from composer.bridges.export.systemd import Installation, units
    from composer.client.hosts.remote_command import python_words

    declared, path, result = exported_system(system, arguments)
    python = (sys.executable, "-P", "-m", "composer")
    file = os.path.relpath(path.resolve(), result.project.root)

    def remote(host: Host, service: Service) -> list[str]:
        return python_words(host, ("-m", "composer", *service.command(file)), os.environ)

    installation = Installation(python, os.environ, remote, None if user else _user())
    found = units(declared, path, installation, user=user)
    if len(found) == 1:
        write_output(next(iter(found.values())), output, replace=force)
        return
    if output is None:
        raise CommandError(
            f"there are {len(found)} units: {', '.join(map(str, found))}",
            hint="name a folder for them with --output",
        )
    write_and_say(output, {str(name): text for name, text in found.items()}, replace=force)


add_image_commands(export_app)


@export_app.command(
    "sros2", epilog=examples("compose export sros2 pipeline -o policies/pipeline.xml")
)
def export_sros2(
    system: SystemName,
    arguments: Arguments = None,
    *,
    namespace: Namespace = None,
    output: NewPath = None,
    force: Force = False,
) -> None:
    """Write the access control policy that a system implies.

    Each process may publish, subscribe, serve and call exactly what its nodes declare, and what ROS
    and the manager node need. The policy is for 'ros2 security create_permission'; the enclave of a
    process is its full name, such as /robot1/pipeline.
    """
    from composer.bridges.export.sros2 import policy

    declared = exported_system(system, arguments, namespace=namespace).system
    write_output(policy(declared), output, replace=force)


class SchemaName(StrEnum):
    """The files that have a schema."""

    SYSTEM = "system"
    NODE = "node"
    PROJECT = "project"
    SCENARIO = "scenario"
    REPORT = "report"


@export_app.command(
    "schema",
    epilog=examples(
        "compose export schema system > schemas/system.schema.json",
        "compose export schema node > schemas/node.schema.json",
        "compose export schema scenario > schemas/scenario.schema.json",
        "compose export schema project      the schema of composer.yaml",
        "compose export schema report       the schema of 'compose validate --format json'",
    ),
)
def export_schema(
    name: Annotated[
        SchemaName,
        typer.Argument(metavar="NAME", help="system, node, scenario, project or report."),
    ],
) -> None:
    """Print a JSON Schema (draft-07) for editors.

    An editor with a YAML language server uses it for completion and checks. Add this as the first
    line of a file: "# yaml-language-server: $schema=../schemas/system.schema.json".
    """
    from composer.language.schema import schema

    write(as_json(schema(name.value), indent=2))


def _user() -> str:
    """Return the name of this user, or the number if there is no name."""
    number = os.geteuid()
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return str(number)
