"""``compose schema``: the JSON Schemas, for editors."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import Annotated

import typer

from composer.cli.support.help import examples
from composer.cli.support.terminal import write

EPILOG = examples(
    "compose schema system > schemas/system.schema.json",
    "compose schema node > schemas/node.schema.json",
    "compose schema project      composer.yaml",
    "compose schema report       what compose validate --format json writes",
)


class Name(StrEnum):
    """What a schema is about."""

    SYSTEM = "system"
    NODE = "node"
    PROJECT = "project"
    REPORT = "report"


def schema(name: Annotated[Name, typer.Argument(help="The kind of file.")]) -> None:
    """Print the JSON Schema (draft-07) of systems, node types, settings or reports.

    An editor with a YAML language server completes and checks by it: put
    "# yaml-language-server: $schema=../schemas/system.schema.json" on the first line of a file.
    """
    from composer.schema import schema as find

    write(json.dumps(find(name.value), indent=2))
