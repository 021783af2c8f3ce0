"""The commands of ``compose``, put together. A new command is a file here and a word below."""

from __future__ import annotations

import os
from collections.abc import Iterable
from importlib import import_module
from typing import Annotated

import typer

from composer.cli.support.help import examples
from composer.cli.support.terminal import write

#: Each is a module here: with a function of its name and an EPILOG, or with an ``app`` of its own.
COMMANDS = (
    "run",
    "ps",
    "top",
    "up",
    "down",
    "pause",
    "resume",
    "reset",
    "validate",
    "config",
    "graph",
    "diff",
    "lifecycle",
    "node",
    "topic",
    "service",
    "action",
    "param",
    "interface",
    "doctor",
    "rule",
    "schema",
)


EPILOG = examples(
    "compose run pipeline                        run an example system",
    "compose run systems/pipeline.yaml           validate, bring up, keep up, tear down",
    "compose validate systems nodes              every finding in one run",
    "compose lifecycle set planner deactivate    from another terminal",
    "compose graph systems/pipeline.yaml         a diagram, as Mermaid text",
)


def application(arguments: Iterable[str] = ()) -> typer.Typer:
    """Return the application for a command line.

    Where ``arguments`` begin with a command it has that one only: to import and put together all
    of them takes longer than most of them run.
    """
    app = typer.Typer(
        no_args_is_help=True,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback(epilog=EPILOG)(compose)
    wanted = next((text for text in arguments if not text.startswith("-")), None)
    for name in (wanted,) if wanted in COMMANDS else COMMANDS:
        _add(app, str(name))
    return app


def _add(app: typer.Typer, name: str) -> None:
    module = import_module(f"composer.cli.commands.{name}")
    if hasattr(module, "app"):
        app.add_typer(module.app, name=name)
    else:
        app.command(name, epilog=module.EPILOG)(getattr(module, name))


def _show_version(asked: bool) -> None:
    if asked:
        from composer.report.tool import tool_version

        write(f"compose {tool_version()}")
        raise typer.Exit


def _set_debug(asked: bool) -> None:
    if asked:
        os.environ["COMPOSE_DEBUG"] = "1"


def compose(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
    debug: Annotated[
        bool,
        typer.Option(
            "--debug",
            callback=_set_debug,
            help="Show the traceback of an internal error (also: COMPOSE_DEBUG=1).",
        ),
    ] = False,
) -> None:
    """Declare, prove and run a ROS 2 system.

    YAML says what the system is; compose checks it before anything starts, runs it as real
    lifecycle nodes in one process, and lets any ROS 2 tool see it.

    Exit codes: 0 clean, 1 findings or a node failed, 2 usage, 3 internal error.
    """
