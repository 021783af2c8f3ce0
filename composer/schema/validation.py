"""What is wrong with the shape of a file: jsonschema finds it, we say it with its place."""

from __future__ import annotations

from typing import Any

from jsonschema import Draft7Validator
from jsonschema.validators import extend
from referencing import Registry

from composer.diagnostics import Diagnostic
from composer.schema.explanations import explain_errors
from composer.schema.locations import TreeIndex
from composer.tree import Mapping, Plain

_DEFINITIONS = "#/definitions/"
_validators: dict[str, Draft7Validator] = {}


def explain(content: Plain, tree: Mapping, kind: str, whole: dict[str, Any]) -> list[Diagnostic]:
    """Return what is wrong with ``content``, which is ``tree`` without index.

    ``whole`` is the schema of ``kind``.
    """
    if kind not in _validators:
        _validators[kind] = _validator(whole)
    return explain_errors(_validators[kind].iter_errors(content), TreeIndex(tree))


def _validator(whole: dict[str, Any]) -> Draft7Validator:
    definitions = whole["definitions"]
    root = {name: part for name, part in whole.items() if name != "definitions"}
    # 10.0 is an integer to JSON Schema, and not to ROS.
    types = Draft7Validator.TYPE_CHECKER.redefine("integer", _is_integer)
    strict = extend(Draft7Validator, type_checker=types)  # type: ignore[no-untyped-call]
    # An empty registry fetches nothing; with references filled in there is nothing to fetch.
    filled_in = _filled_in(root, definitions)
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
