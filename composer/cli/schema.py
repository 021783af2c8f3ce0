"""``compose schema``: the JSON Schemas, for editors."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import Annotated

import typer

from composer.cli.help import examples
from composer.cli.terminal import write

EPILOG = examples(
    "compose schema system > system.schema.json",
    "compose schema node",
)


class Name(StrEnum):
    """The kinds of file."""

    SYSTEM = "system"
    NODE = "node"


def schema(name: Annotated[Name, typer.Argument(help="The kind of file.")]) -> None:
    """Print the JSON Schema (draft-07) of system files or of node types.

    An editor with a YAML language server completes and checks by it: put
    "# yaml-language-server: $schema=system.schema.json" on the first line of a file.
    """
    from composer.schema import schema as find

    write(json.dumps(find(name.value), indent=2))
