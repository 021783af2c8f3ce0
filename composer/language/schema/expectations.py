"""Describe what a schema expects, and hints for values of the wrong type."""

from __future__ import annotations

from collections.abc import Set
from typing import Any

_SUBSTITUTION = r"\$\{"
_EXPRESSION = r"\{"
_WORDS = {
    "object": "a map",
    "array": "a list",
    "string": "a string",
    "number": "a number",
    "integer": "an integer",
    "boolean": "true or false",
    "null": "null",
}
_WORDS_FOR_TRUTH = frozenset({"yes", "no", "on", "off"})


def expected(schema: dict[str, Any]) -> str:
    """Return the expected types, such as ``a number or an '{expression}'``.

    Load-time variables, which are allowed anywhere, are not mentioned.
    """
    words = [_WORDS[kind] for kind in _types(schema)]
    if schema.get("pattern") == _EXPRESSION:
        words.append("an '{expression}'")
    *most, last = words
    return f"{', '.join(most)} or {last}" if most else last


def type_hint(schema: dict[str, Any], found: object) -> str | None:
    """Return a hint how to fix ``found`` for common mistakes."""
    allowed = _types(schema)
    match found:
        case str():
            return _text_hint(schema, allowed.keys(), found)
        case bool() | int() | float() if allowed.keys() == {"string"}:
            return "quote it if it is a string"
        case list() if allowed.keys() == {"object"}:
            return "write 'name: ...' for each, without a dash"
        case None if allowed.keys() == {"object"}:
            return "an empty map is written '{}'"
    return None


def _text_hint(schema: dict[str, Any], allowed: Set[str], found: str) -> str | None:
    if "boolean" in allowed:
        return "write true or false" if found.casefold() in _WORDS_FOR_TRUTH else None
    if found[:1].isdigit() and allowed & {"number", "integer"}:
        return "write the number alone; the key names the unit"
    if "object" in allowed and schema.get("pattern") == _EXPRESSION:
        return "name the field: {data: ...}"
    return "write a list: [...]" if "array" in allowed else None


def _types(schema: dict[str, Any]) -> dict[str, None]:
    """Return the JSON types that ``schema`` allows, in order, without text limited by a pattern."""
    types = schema.get("type", [])
    kinds = dict.fromkeys([types] if isinstance(types, str) else types)
    if "pattern" in schema and len(kinds) > 1:
        kinds.pop("string", None)
    return kinds
