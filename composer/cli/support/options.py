"""Options and help texts that several commands share."""

from __future__ import annotations

import sys
from collections.abc import Collection
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from composer.cli.support.errors import UsageError

#: About thirty years, in seconds: longer times overflow the clocks of the operating system.
_LARGEST = 1e9


def quantity(
    unit: str,
    *names: str,
    help: str,  # noqa: A002 - as in typer
    min: float = 0.0,  # noqa: A002
    show_default: bool | str = True,
) -> Any:
    """Return an option for a number with a unit, such as SECONDS; all of them have limits."""
    return typer.Option(
        *names, metavar=unit, min=min, callback=_finite, help=help, show_default=show_default
    )


def _finite(value: float | None) -> float | None:
    """Return the value of an option; reject infinity, NaN and what no clock can represent."""
    if value is not None and not value <= _LARGEST:
        raise typer.BadParameter(f"{value:g} is not in the range x<={_LARGEST:g}.")
    return value


def examples(*lines: str) -> str:
    """Return the epilog of a help page: commands to copy, one per line, printed verbatim."""
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


class _Group(TyperGroup):
    """Commands below one word; the help ends with the first example of each."""

    def format_epilog(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 - as in the base
        """Write the examples to the help page."""
        formatter.write("\n  Examples:\n")
        for command in self.commands.values():
            if not command.hidden and command.epilog:
                formatter.write(f"  {command.epilog.splitlines()[2]}\n")


def command_group(text: str) -> typer.Typer:
    """Return an application for commands below one word, with its help text."""
    return typer.Typer(cls=_Group, help=text, no_args_is_help=True, rich_markup_mode=None)


Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Hidden = Annotated[
    bool, typer.Option("--all", "-a", help="Include names that start with an underscore.")
]
ShowTypes = Annotated[bool, typer.Option("--show-types", "-t", help="Print the types as well.")]

#: The time limit of a command for everything that it waits for.
Timeout = Annotated[
    float, quantity("SECONDS", "--timeout", help="Maximum time to wait for nodes and responses.")
]
DEFAULT_TIMEOUT_S = 5.0
#: As long as a transition may take by default, with a margin.
CHANGE_TIMEOUT_S = 15.0

#: Named explicitly: typer takes a metavar equal to the parameter's name in capitals for the name.
Namespace = Annotated[
    str | None,
    typer.Option("--namespace", metavar="NAMESPACE", help="Override the namespace of the system."),
]


class Autostart(StrEnum):
    """The states up to which nodes can be brought up."""

    ACTIVE = "active"
    INACTIVE = "inactive"
    UNCONFIGURED = "unconfigured"


class LogSeverity(StrEnum):
    """The log severities of ROS."""

    DEBUG = "debug"
    INFO = "info"
    WARN = "warn"
    ERROR = "error"
    FATAL = "fatal"


# How to start a system; commands that compare a file with the running system need the same options.
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NODE.PARAMETER=VALUE", help="Override a parameter. Repeatable."),
]
UseSimTime = Annotated[
    bool, typer.Option("--use-sim-time", help="Use /clock unless a node sets use_sim_time.")
]
AutostartTo = Annotated[
    Autostart | None,
    typer.Option(
        "--autostart",
        help="The state to which the nodes are brought up.",
        show_default="as declared in the system",
    ),
]
LogLevelOption = Annotated[
    LogSeverity | None,
    typer.Option("--log-level", help="Minimum severity of log messages.", show_default="info"),
]

AllOrNothing = Annotated[
    bool,
    typer.Option(
        "--all-or-nothing", help="Undo the bring-up if a node fails, whatever its 'on_failure'."
    ),
]


#: The parameters of commands with these options.
START_OPTIONS = ("settings", "namespace", "use_sim_time", "autostart", "log_level")


def given_options(context: typer.Context, names: Collection[str]) -> list[str]:
    """Return the options with these parameter names as words of a command line, if given."""
    words: list[str] = []
    for option in context.command.params:
        name = option.name or ""
        source = context.get_parameter_source(name)
        if name not in names or source is None or source.name != "COMMANDLINE":
            continue
        value = context.params[name]
        for item in value if isinstance(value, list | tuple) else [value]:
            if isinstance(item, bool):
                words.append((option.opts if item else option.secondary_opts)[-1])
            else:
                words += [option.opts[-1], str(item)]
    return words


NewFile = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE", help="Write to a new file instead of stdout."),
]

Stdin = Annotated[bool, typer.Option("--stdin", help="Read the YAML from standard input.")]


def yaml_or_stdin(text: str | None, stdin: bool) -> str:
    """Return the YAML of an argument, of standard input, or an empty map. Raises UsageError.

    Standard input may end with the marker that 'compose topic echo' prints after a message.
    """
    if not stdin:
        return "{}" if text is None else text
    if text is not None:
        raise UsageError("the YAML is given as an argument or with --stdin, not both")
    return sys.stdin.read().rstrip().removesuffix("\n---")
