"""The command-line application. To add a command, add a module and a line in COMMANDS."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib import import_module
from itertools import takewhile
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from composer.cli.support.options import examples
from composer.cli.support.terminal import write

#: The commands under the headings of the help. The module of that name in composer.cli.commands has
#: ``<name>_app`` with subcommands, or a function with the name of the command and its epilog,
#: ``EPILOG``.
COMMANDS = {
    "Commands for systems": (
        *("run", "down", "ps", "top", "logs", "record", "replay", "dashboard", "hosts"),
    ),
    "Commands for files": (
        *("validate", "test", "config", "graph", "diff", "stubs"),
        *("new", "import", "export", "bag"),
    ),
    "Commands for ROS 2": (
        "lifecycle",
        "node",
        "topic",
        "service",
        "action",
        "param",
        "log-level",
        "interface",
        "doctor",
    ),
}
_ALL = tuple(name for names in COMMANDS.values() for name in names)
_OTHER_MODULES = {
    "down": "lifecycle",
    "import": "import_nodes",
    "node": "nodes",
    "log-level": "nodes",
    "test": "scenarios",
    "service": "calls",
    "action": "calls",
}

#: What users of docker compose, ruff and ros2 type, and the command that does it here.
ELSEWHERE = {
    "up": "run",
    "start": "run",
    "launch": "run",
    "stop": "down",
    "restart": "lifecycle restart",
    "pause": "lifecycle pause",
    "unpause": "lifecycle resume",
    "check": "validate",
    "rule": "validate --explain",
    "init": "new project",
    "build": "interface build",
    "pkg": "new",
}

EPILOG = examples(
    "compose run pipeline                        run an example system",
    "compose run systems/pipeline.yaml           run your own system",
    "compose validate systems nodes              report all problems in your files",
    "compose lifecycle set planner deactivate    change a running node",
    "compose graph systems/pipeline.yaml         draw a diagram",
)


class _Program(TyperGroup):
    """The program; its help lists the commands under headings."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that ``args`` name; for a word of another tool, name ours."""
        ours = ELSEWHERE.get(args[0])
        if ours is not None:
            ctx.fail(f"No such command '{args[0]}'. Use 'compose {ours}'.")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 - as in the base
        """Write the commands to the help page."""
        width = formatter.width - max(map(len, self.commands)) - 6  # as typer does
        for heading, names in COMMANDS.items():
            with formatter.section(heading):
                formatter.write_dl(
                    [(name, self.commands[name].get_short_help_str(width)) for name in names]
                )


def application(arguments: Sequence[str] = ()) -> typer.Typer:
    """Return the application for a command line.

    Only the command in ``arguments`` is imported: importing all of them takes longer than most
    commands run.
    """
    app = typer.Typer(
        cls=_Program,
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
    options = list(takewhile(lambda text: text.startswith("-"), arguments))
    command = next(iter(arguments[len(options) :]), None)
    if command not in _ALL or not {"-h", "--help"}.isdisjoint(options):
        return _ALL
    return (command,)


def _add(app: typer.Typer, name: str) -> None:
    word = name.replace("-", "_")
    module = import_module(f"composer.cli.commands.{_OTHER_MODULES.get(name, word)}")
    group = getattr(module, f"{word}_app", None)
    if group is not None:
        app.add_typer(group, name=name)
    else:
        app.command(name, epilog=module.EPILOG)(getattr(module, word))


def _print_version(requested: bool) -> None:
    if requested:
        from composer import version

        write(f"compose {version()}")
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

    Exit codes: 0 success, 1 errors in files or a failed node, 2 usage error, 3 internal error; 78
    if 'compose run' cannot start because of errors in files.
    """
