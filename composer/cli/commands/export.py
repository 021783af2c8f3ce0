"""``compose export``: files with which other tools run a system."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import FAILED, CommandError
from composer.cli.support.options import examples
from composer.cli.support.system_arguments import SystemName, load_system, system_file
from composer.cli.support.terminal import say, write_raw

if TYPE_CHECKING:
    from composer.model import System

app = typer.Typer(
    help="""Write files with which other tools run a system.

    They are functions of the system: export again after changes.
    """,
    epilog=examples(
        "compose export launch systems/robot.yaml -o launch/robot.launch.py",
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE",
        help="Write to a new file instead of stdout.",
        show_default=False,
    ),
]


@app.callback()
def export() -> None:
    """Write files with which other tools run a system.

    They are functions of the system: export again after changes.
    """


@app.command(
    "launch", epilog=examples("compose export launch pipeline -o launch/pipeline.launch.py")
)
def export_launch(system: SystemName, *, output: Output = None) -> None:
    """Write a launch file that runs a system.

    It has launch arguments for the namespace, simulated time and the log level, and ends with the
    system. To run a system from a launch file of your own, use its action ComposeSystem.
    """
    from composer.export.launch_file import launch_file

    path = system_file(system)
    _write(launch_file(_load(system, path), path, output), output)


def _load(text: str, path: Path) -> System:
    """Return a system without errors. Raises CommandError, typer.Exit."""
    result = load_system(path, shown=text)
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
