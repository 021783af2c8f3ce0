"""The shape of a file: which keys there are and what may stand under them, by JSON Schema.

The schemas are files (``schemas/``), so that editors use the very same ones. What jsonschema says
is told with the place of the key or value that is meant, in words of the language.
"""

from __future__ import annotations

import json
from functools import cache
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic
from composer.resources import schemas_folder
from composer.schema.findings import findings_of
from composer.schema.places import Places
from composer.schema.shape import Test, shape
from composer.tree import Mapping, plain

if TYPE_CHECKING:
    from jsonschema import Draft7Validator

__all__ = ["KINDS", "REPORT", "SCHEMAS", "check_schema", "kind_of", "schema"]

#: The kinds of file about nodes, each with a schema of that name; also the key that marks one.
KINDS = ("system", "node")
SCHEMAS = (*KINDS, "project")
#: What is written, not read: the report of ``compose validate --format json``.
REPORT = "report"

_DEFINITIONS = "#/definitions/"


def kind_of(tree: Mapping) -> str | None:
    """Return ``system`` or ``node``, by the first key of the two; None when there is neither."""
    return next((entry.name for entry in tree if entry.name in KINDS), None)


def check_schema(tree: Mapping, kind: str) -> list[Diagnostic]:
    """Return everything that has the wrong shape in a file of ``kind``.

    The tree is the one after ``expand``. A load-time variable without value fits everywhere.
    """
    content = plain(tree)
    if _shape(kind)(content):
        return []
    return findings_of(_validator(kind).iter_errors(content), Places(tree))


def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema (draft-07) called ``name``, of SCHEMAS or REPORT. Raises KeyError."""
    if name not in (*SCHEMAS, REPORT):
        raise KeyError(name)
    text = (schemas_folder() / f"{name}.schema.json").read_text(encoding="utf-8")
    content: dict[str, Any] = json.loads(text)
    return content


@cache
def _shape(kind: str) -> Test:
    return shape(schema(kind))


@cache
def _validator(kind: str) -> Draft7Validator:
    # Imported here, for it takes a tenth of a second, and most files are right.
    from jsonschema import Draft7Validator  # noqa: PLC0415
    from jsonschema.validators import extend  # noqa: PLC0415
    from referencing import Registry  # noqa: PLC0415

    whole = schema(kind)
    definitions = whole.pop("definitions")
    # 10.0 is an integer to JSON Schema, and not to ROS.
    types = Draft7Validator.TYPE_CHECKER.redefine("integer", _is_integer)
    strict = extend(Draft7Validator, type_checker=types)  # type: ignore[no-untyped-call]
    # An empty registry fetches nothing; with references filled in there is nothing to fetch.
    filled_in = _filled_in(whole, definitions)
    validator: Draft7Validator = strict(filled_in, registry=Registry())
    return validator


def _is_integer(_: object, value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _filled_in(part: Any, definitions: dict[str, Any]) -> Any:
    """Return ``part`` with definitions in place of references to them: that halves the time.

    What stands beside a ``$ref`` describes it, and means nothing to a validator (draft-07).
    """
    match part:
        case {"$ref": reference}:
            return _filled_in(definitions[reference.removeprefix(_DEFINITIONS)], definitions)
        case dict():
            return {key: _filled_in(value, definitions) for key, value in part.items()}
        case list():
            return [_filled_in(item, definitions) for item in part]
    return part
