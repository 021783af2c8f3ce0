"""Options and help texts that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer

#: About thirty years, in seconds: longer times overflow the clocks of the operating system.
_LARGEST = 1e9


def finite(value: float | None) -> float | None:
    """Return the value of an option; reject infinity, NaN and what no clock can represent."""
    if value is not None and not value <= _LARGEST:
        raise typer.BadParameter(f"{value:g} is not in the range x<={_LARGEST:g}.")
    return value


def examples(*lines: str) -> str:
    """Return the epilog of a help page: commands to copy, one per line, printed verbatim."""
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Count = Annotated[bool, typer.Option("--count", "-c", help="Print only the number of names.")]
ShowTypes = Annotated[bool, typer.Option("--show-types", "-t", help="Print the types as well.")]
Hidden = Annotated[
    bool,
    typer.Option("--include-hidden", "-a", help="Include names that start with an underscore."),
]

#: The time limit of a command for everything that it waits for.
Timeout = Annotated[
    float,
    typer.Option(
        "--timeout",
        metavar="SECONDS",
        min=0.0,
        callback=finite,
        help="Maximum time to wait for nodes and responses.",
    ),
]
DEFAULT_TIMEOUT_S = 5.0

#: Named explicitly: typer takes a metavar equal to the parameter's name in capitals for the name.
Namespace = Annotated[
    str | None,
    typer.Option(
        "--namespace",
        metavar="NAMESPACE",
        help="Override the namespace of the system.",
        show_default=False,
    ),
]
