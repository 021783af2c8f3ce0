"""``compose config``: a file with everything put into it that it refers to."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from composer.cli.support.failure import FINDINGS
from composer.cli.support.help import examples
from composer.cli.support.loaded import SystemName, load_system
from composer.cli.support.terminal import say, write, write_raw

EPILOG = examples(
    "compose config systems/fleet.yaml",
    "compose config systems/fleet.yaml --json | jq .nodes",
    "compose config nodes/watchdog.yaml",
)


def config(
    system: SystemName,
    *,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of YAML.")] = False,
) -> None:
    """Print a system as one file: what it includes, its copies and its variables put in.

    What is printed is a system itself, in canonical YAML, and means the same beside the file. Of a
    node type it shows what that is with all that it extends. Needs no ROS.

    Exit code 1 when there is an error, and nothing is printed.
    """
    from composer.assembly.canonical import canonical
    from composer.cli.support.files import system_file
    from composer.document.writer import write_document
    from composer.loading import gives_same_model
    from composer.tree import plain

    path = system_file(system)
    loading = load_system(path, shown=system)
    if loading.tree is None or not loading.is_valid:
        raise typer.Exit(FINDINGS)
    whole = canonical(loading.tree)
    text = write_document(whole)
    if not gives_same_model(loading, text):
        say(
            "note: node types, behaviours and parameter files beside the files that were put in"
            " are not found from elsewhere"
        )
    if as_json:
        write(json.dumps(plain(whole), indent=2, ensure_ascii=False))
    else:
        write_raw(text)
