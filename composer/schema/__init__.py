"""The shape of a file: which keys there are and what may stand under them, by JSON Schema.

The schemas are files (``schemas/``), so that editors use the very same ones. What jsonschema says
is told with the place of the key or value that is intended_key, in words of the language.
"""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from composer.diagnostics import Diagnostic
from composer.resources import schemas_folder
from composer.schema import rules  # noqa: F401 - they are known before the first is broken
from composer.schema.fast_check import Check, compile_check
from composer.tree import Mapping, plain

__all__ = ["KINDS", "REPORT", "SCHEMAS", "check_schema", "kind_of", "schema"]

#: The kinds of file about nodes, each with a schema of that name; also the key that marks one.
KINDS = ("system", "node")
SCHEMAS = (*KINDS, "project")
#: What is written, not read: the report of ``compose validate --format json``.
REPORT = "report"


def kind_of(tree: Mapping) -> str | None:
    """Return ``system`` or ``node``, by the first key of the two; None when there is neither."""
    return next((entry.name for entry in tree if entry.name in KINDS), None)


def check_schema(tree: Mapping, kind: str) -> list[Diagnostic]:
    """Return everything that has the wrong shape in a file of ``kind``.

    The tree is the one after ``expand``. A load-time variable without value fits everywhere.
    """
    content = plain(tree)
    if _compiled(kind)(content):
        return []
    # What explains mistakes takes a tenth of a second to import, and most files are right.
    from composer.schema.validation import explain  # noqa: PLC0415

    return explain(content, tree, kind, schema(kind))


def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema (draft-07) called ``name``, of SCHEMAS or REPORT. Raises KeyError."""
    if name not in (*SCHEMAS, REPORT):
        raise KeyError(name)
    text = (schemas_folder() / f"{name}.schema.json").read_text(encoding="utf-8")
    content: dict[str, Any] = json.loads(text)
    return content


@cache
def _compiled(kind: str) -> Check:
    return compile_check(schema(kind))
