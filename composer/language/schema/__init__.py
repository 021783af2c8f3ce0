"""Check the structure of files with JSON Schema: keys and types of values.

Editors use the same schemas (``schemas/``). Errors are reported with the location of the key or
value, in terms of the language.
"""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from composer.base.diagnostics import Diagnostic
from composer.base.folders import schemas_folder
from composer.language.schema.explanations import explain_errors
from composer.language.schema.validation import schema_errors
from composer.language.tree import Mapping, plain

__all__ = ["KINDS", "REPORT", "SCHEMAS", "check_schema", "kind_of", "schema"]

#: The kinds of files, each with a schema of that name and marked by a key of that name. A scenario
#: has the key ``system`` as well.
KINDS = ("scenario", "system", "node")
SCHEMAS = ("system", "node", "project", "scenario")
#: The schema of the output of ``compose validate --format json``.
REPORT = "report"


def kind_of(tree: Mapping) -> str | None:
    """Return the kind of a file: ``scenario``, or else the first of its keys that is a kind."""
    names = [entry.name for entry in tree if entry.name in KINDS]
    return "scenario" if "scenario" in names else next(iter(names), None)


def check_schema(tree: Mapping, kind: str) -> list[Diagnostic]:
    """Return the schema diagnostics of a file of ``kind``.

    The tree has its variables expanded. A load-time variable without value is valid anywhere.
    """
    return explain_errors(schema_errors(plain(tree), schema(kind)), tree)


@cache
def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema (draft-07) called ``name``, of SCHEMAS or REPORT. Raises KeyError."""
    if name not in (*SCHEMAS, REPORT):
        raise KeyError(name)
    text = (schemas_folder() / f"{name}.schema.json").read_text(encoding="utf-8")
    content: dict[str, Any] = json.loads(text)
    return content
