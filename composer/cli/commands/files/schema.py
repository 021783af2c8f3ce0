"""``compose schema``: print the JSON Schemas, for editors."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from composer.cli.support.options import examples
from composer.cli.support.output.results import as_json
from composer.cli.support.output.terminal import write

EPILOGS = {
    "schema": examples(
        "compose schema system > schemas/system.schema.json",
        "compose schema node > schemas/node.schema.json",
        "compose schema project      the schema of composer.yaml",
        "compose schema report       the schema of 'compose validate --format json'",
    )
}


class SchemaName(StrEnum):
    """The files that have a schema."""

    SYSTEM = "system"
    NODE = "node"
    PROJECT = "project"
    REPORT = "report"


def schema(
    name: Annotated[
        SchemaName, typer.Argument(metavar="NAME", help="system, node, project or report.")
    ],
) -> None:
    """Print a JSON Schema (draft-07) for editors.

    An editor with a YAML language server uses it for completion and checks. Add this as the first
    line of a file: "# yaml-language-server: $schema=../schemas/system.schema.json".
    """
    from composer.language.schema import schema as find

    write(as_json(find(name.value), indent=2))
