"""The command-line application. To add a command, add a module and a line in COMMANDS."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated

import typer

from composer.cli.support.options import examples
from composer.cli.support.terminal import write

#: Each command and its module in composer.cli.commands. The module has an ``app`` with subcommands,
#: or a function with the name of the command and the epilogs of its commands in ``EPILOGS``.
COMMANDS = {
    "run": "run",
    "ps": "ps",
    "top": "top",
    "logs": "logs",
    "up": "manage",
    "down": "manage",
    "pause": "manage",
    "resume": "manage",
    "reset": "manage",
    "restart": "restart",
    "validate": "validate",
    "config": "config",
    "graph": "graph",
    "diff": "diff",
    "dashboard": "dashboard",
    "import": "import_nodes",
    "export": "export",
    "new": "new",
    "interfaces": "interfaces",
    "lifecycle": "lifecycle",
    "node": "node",
    "topic": "topic",
    "service": "service",
    "action": "action",
    "param": "param",
    "interface": "interface",
    "doctor": "doctor",
    "rule": "rule",
    "schema": "schema",
}

EPILOG = examples(
    "compose run pipeline                        run an example system",
    "compose run systems/pipeline.yaml           run your own system",
    "compose validate systems nodes              report all problems in your files",
    "compose lifecycle set planner deactivate    change a running node",
    "compose graph systems/pipeline.yaml         draw a diagram",
)


def application(arguments: Sequence[str] = ()) -> typer.Typer:
    """Return the application for a command line.

    Only the command in ``arguments`` is imported: importing all of them takes longer than most
    commands run.
    """
    app = typer.Typer(
        no_args_is_help=True,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback(epilog=EPILOG)(compose)
    for name in _needed_commands(arguments):
        _add(app, name)
    return app


def _needed_commands(arguments: Sequence[str]) -> Sequence[str]:
    if list(arguments) == ["--version"]:
        return ()
    command = next((text for text in arguments if not text.startswith("-")), None)
    return (command,) if command in COMMANDS else tuple(COMMANDS)


def _add(app: typer.Typer, name: str) -> None:
    module = import_module(f"composer.cli.commands.{COMMANDS[name]}")
    if hasattr(module, "app"):
        app.add_typer(module.app, name=name)
    else:
        app.command(name, epilog=module.EPILOGS[name])(getattr(module, name))


def _print_version(requested: bool) -> None:
    if requested:
        from composer.report.tool import tool_version

        write(f"compose {tool_version()}")
        raise typer.Exit


def _set_debug(requested: bool) -> None:
    if requested:
        os.environ["COMPOSE_DEBUG"] = "1"


def compose(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
    debug: Annotated[
        bool,
        typer.Option(
            "--debug",
            callback=_set_debug,
            help="Print complete tracebacks of all errors (or set COMPOSE_DEBUG=1).",
        ),
    ] = False,
) -> None:
    """Define, validate and run ROS 2 systems.

    A system is declared in YAML files. The files are validated, and the nodes run as lifecycle
    nodes in one process. All ROS 2 tools work with a running system.

    Exit codes: 0 success, 1 errors in files or a failed node, 2 usage error, 3 internal error.
    """
