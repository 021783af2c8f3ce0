"""``compose config``: print a system with everything resolved."""

from __future__ import annotations

from typing import Annotated

import typer

from composer.cli.support.errors import FAILED
from composer.cli.support.name_values import Arguments
from composer.cli.support.options import examples
from composer.cli.support.system_arguments import SystemName, load_system
from composer.cli.support.terminal import as_json, say, write, write_raw

EPILOG = examples(
    "compose config systems/fleet.yaml",
    "compose config systems/fleet.yaml --json | jq .nodes",
    "compose config nodes/watchdog.yaml",
)


def config(
    system: SystemName,
    arguments: Arguments = None,
    *,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of YAML.")] = False,
) -> None:
    """Print a system as a single resolved file.

    Includes, copies (for_each), conditions and arguments are replaced by their results. The output
    is a system in canonical YAML, equivalent to the original if saved in the same folder. For a
    node type, the output contains everything that it extends. ROS is not needed.

    Exit code 1 if the system has errors; then nothing is printed.
    """
    from composer.cli.support.system_arguments import system_file
    from composer.language.document.writer import canonical, write_document
    from composer.language.tree import plain
    from composer.loading import gives_same_model

    path = system_file(system)
    result = load_system(path, system, arguments)
    if result.tree is None or not result.is_valid:
        raise typer.Exit(FAILED)
    whole = canonical(result.tree)
    text = write_document(whole)
    if not gives_same_model(result, text):
        say(
            "note: node types, behaviors and parameter files next to an included file are not found"
            " from this file"
        )
    if json:
        write(as_json(plain(whole), indent=2))
    else:
        write_raw(text)
