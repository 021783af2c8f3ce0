"""``compose export``: files with which other tools run a system."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import FAILED, CommandError
from composer.cli.support.options import Namespace, NewFile, examples
from composer.cli.support.system_arguments import SystemName, load_system, system_file
from composer.cli.support.terminal import say, write_raw

if TYPE_CHECKING:
    from composer.model import System

app = typer.Typer(
    help="""Write files with which other tools run a system.

    The files are derived from the system: export again after changes.
    """,
    epilog=examples(
        "compose export launch systems/robot.yaml -o launch/robot.launch.py",
        "compose export systemd systems/robot.yaml -o robot.service",
        "compose export sros2 systems/robot.yaml -o policies/robot.xml",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)


@app.callback()
def export() -> None:
    """Write files with which other tools run a system.

    The files are derived from the system: export again after changes.
    """


@app.command(
    "launch", epilog=examples("compose export launch pipeline -o launch/pipeline.launch.py")
)
def export_launch(system: SystemName, *, output: NewFile = None) -> None:
    """Write a launch file that runs a system.

    It has launch arguments for the namespace, simulated time and the log level, and ends with the
    system. To run a system from a launch file of your own, use its action ComposeSystem.
    """
    from composer.export.launch_file import launch_file

    path = system_file(system)
    _write(launch_file(_load(system, path), path, output), output)


@app.command(
    "systemd",
    epilog=examples(
        "compose export systemd systems/robot.yaml -o robot.service",
        "compose export systemd robot --user -o ~/.config/systemd/user/robot.service",
    ),
)
def export_systemd(
    system: SystemName,
    *,
    user: Annotated[
        bool, typer.Option("--user", help="For the service manager of a user, not of the system.")
    ] = False,
    output: NewFile = None,
) -> None:
    """Write a systemd unit that runs a system.

    The unit runs it in this Python environment, with the variables of ROS that are set now. It
    restarts the system if a node fails permanently, and shuts it down in order.
    """
    import os
    import sys

    from composer.export.systemd import unit

    path = system_file(system)
    python = (sys.executable, "-P", "-m", "composer")
    _write(unit(_load(system, path), path, python, os.environ, user=user), output)


@app.command("sros2", epilog=examples("compose export sros2 pipeline -o policies/pipeline.xml"))
def export_sros2(
    system: SystemName, *, namespace: Namespace = None, output: NewFile = None
) -> None:
    """Write the access control policy that a system implies.

    Each process may publish, subscribe, serve and call exactly what its nodes declare, and what ROS
    and the manager node need. The policy is for 'ros2 security create_permission'; the enclave of a
    process is its full name, such as /robot1/pipeline.
    """
    from composer.export.sros2 import policy

    _write(policy(_load(system, system_file(system), namespace)), output)


def _load(text: str, path: Path, namespace: str | None = None) -> System:
    """Return a system without errors. Raises CommandError, typer.Exit."""
    result = load_system(path, shown=text, namespace=namespace)
    if result.system is not None and result.system.node_type:
        raise CommandError(f"'{text}' is a node type, not a system")
    if result.system is None or not result.is_runnable:
        raise typer.Exit(FAILED)
    return result.system


def _write(text: str, output: Path | None) -> None:
    """Write to stdout, or to a new file. Raises CommandError."""
    if output is None:
        write_raw(text)
        return
    from composer.cli.support.new_files import write_new_file

    write_new_file(output, text)
    say(f"wrote {output}")
