"""Lists of names: the options and the print that all ``... list`` commands share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from composer.cli.support.terminal import columns, say, write
from composer.cli.support.values import as_json

ShowTypes = Annotated[bool, typer.Option("--show-types", "-t", help="Print the types too.")]
Count = Annotated[bool, typer.Option("--count", "-c", help="Print the number only.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
Hidden = Annotated[
    bool, typer.Option("--include-hidden", "-a", help="Also names that begin with an underscore.")
]


def say_none_found(kind: str) -> None:
    """Tell the person why there may be nothing to list."""
    say(f"no {kind} was found: is the system running, with the same ROS_DOMAIN_ID?")


def print_names(
    kind: str, named: Sequence[tuple[str, tuple[str, ...]]], *, types: bool, count: bool, json: bool
) -> None:
    """Print names, with their types or not, or how many there are."""
    if count:
        write(str(len(named)))
    elif json:
        write(as_json([{"name": name, "types": list(found)} for name, found in named], indent=2))
    elif named:
        rows = [(name, ", ".join(found)) if types else (name,) for name, found in named]
        write(columns(rows))
    else:
        say_none_found(kind)
