"""Check values against a JSON Schema (draft-07), without a library.

Importing jsonschema takes longer than everything else that ``compose validate`` does with a small
file, and generating code from a schema takes a second. A test compares the results with jsonschema.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import field
from functools import cache
from typing import Any, TypeAlias

from composer.base.fast_dataclass import dataclass

Path: TypeAlias = tuple[str | int, ...]

#: The keywords of a schema that check something, with their values and what checks them.
_Checks: TypeAlias = list[tuple[str, Any, Callable[..., Any]]]
#: A schema without reference, its checks, and whether some of them check inner values.
_Resolved: TypeAlias = tuple[dict[str, Any], _Checks, bool]

_DEFINITIONS = "#/definitions/"
_compiled = cache(re.compile)
#: Unlike in JSON Schema, 10.0 is not an integer: it is none in ROS.
_PYTHON_TYPES: dict[str, frozenset[type]] = {
    "object": frozenset({dict}),
    "array": frozenset({list}),
    "string": frozenset({str}),
    "number": frozenset({int, float}),
    "integer": frozenset({int}),
    "boolean": frozenset({bool}),
    "null": frozenset({type(None)}),
}
_NUMBERS = _PYTHON_TYPES["number"]
#: Keywords that only describe, or that belong to another keyword.
_IGNORED = frozenset(
    {"$schema", "title", "description", "default", "examples", "definitions", "then", "else"}
)


@dataclass(frozen=True, slots=True)
class SchemaError:
    """A value that a keyword of a schema refuses.

    ``path`` leads to ``instance``; ``required`` is the value of the keyword in ``schema``.
    """

    path: Path
    keyword: str
    required: Any
    instance: Any
    schema: dict[str, Any]


def schema_errors(content: Any, schema: dict[str, Any]) -> Iterator[SchemaError]:
    """Yield the errors of ``content``. Raises KeyError for an unsupported keyword of the schema."""
    yield from _Validator(schema.get("definitions", {})).errors(content, schema, ())


@dataclass(frozen=True, slots=True)
class _Validator:
    definitions: dict[str, Any]
    _resolved: dict[int, _Resolved] = field(default_factory=dict)  # by the identity of the schema

    def errors(self, value: Any, schema: dict[str, Any], path: Path) -> Iterable[SchemaError]:
        """Return the errors of a value: an empty list of most values, since a generator is slow."""
        found = self._resolved.get(id(schema))
        if found is None:
            found = self._resolved[id(schema)] = self._resolve(schema)
        own, checks, has_inner = found
        if has_inner:
            return self._all_errors(value, own, path, checks)
        return [
            SchemaError(path, keyword, required, value, own)
            for keyword, required, check in checks
            if not check(self, value, required)
        ]

    def _resolve(self, schema: dict[str, Any]) -> _Resolved:
        while "$ref" in schema:  # keywords next to it are ignored
            schema = self.definitions[schema["$ref"].removeprefix(_DEFINITIONS)]
        keywords = [(name, required) for name, required in schema.items() if name not in _IGNORED]
        checks = [
            (name, required, _INNER[name] if name in _INNER else _CHECKS[name])
            for name, required in keywords
        ]
        return schema, checks, any(name in _INNER for name, _ in keywords)

    def _all_errors(
        self, value: Any, schema: dict[str, Any], path: Path, checks: _Checks
    ) -> Iterator[SchemaError]:
        for keyword, required, check in checks:
            if keyword in _INNER:
                yield from check(self, value, schema, path)
            elif not check(self, value, required):
                yield SchemaError(path, keyword, required, value, schema)

    def is_valid(self, value: Any, schema: dict[str, Any]) -> bool:
        return next(iter(self.errors(value, schema, ())), None) is None

    def properties(self, value: Any, schema: dict[str, Any], path: Path) -> Iterator[SchemaError]:
        if type(value) is dict:
            parts = schema["properties"]
            for name, inner in value.items():
                if name in parts and (found := self.errors(inner, parts[name], (*path, name))):
                    yield from found

    def others(self, value: Any, schema: dict[str, Any], path: Path) -> Iterator[SchemaError]:
        """Check the keys that ``properties`` does not name."""
        part = schema["additionalProperties"]
        if type(value) is not dict or part is True:
            return
        names = [name for name in value if name not in schema.get("properties", {})]
        if part is False:
            if names:
                yield SchemaError(path, "additionalProperties", part, value, schema)
            return
        for name in names:
            yield from self.errors(value[name], part, (*path, name))

    def items(self, value: Any, schema: dict[str, Any], path: Path) -> Iterator[SchemaError]:
        if type(value) is list:
            for index, item in enumerate(value):
                yield from self.errors(item, schema["items"], (*path, index))

    def every(self, value: Any, schema: dict[str, Any], path: Path) -> Iterator[SchemaError]:
        for part in schema["allOf"]:
            yield from self.errors(value, part, path)

    def chosen(self, value: Any, schema: dict[str, Any], path: Path) -> Iterator[SchemaError]:
        branch = "then" if self.is_valid(value, schema["if"]) else "else"
        yield from self.errors(value, schema.get(branch, {}), path)


def _has_type(_: _Validator, value: Any, required: str | list[str]) -> bool:
    if isinstance(required, str):
        return type(value) in _PYTHON_TYPES[required]
    return any(type(value) in _PYTHON_TYPES[name] for name in required)


#: Keywords whose errors are those of inner values, or of other schemas of the same value.
_INNER: dict[str, Callable[[_Validator, Any, dict[str, Any], Path], Iterator[SchemaError]]] = {
    "properties": _Validator.properties,
    "additionalProperties": _Validator.others,
    "items": _Validator.items,
    "allOf": _Validator.every,
    "if": _Validator.chosen,
}
#: Keywords that a value satisfies or not.
_CHECKS: dict[str, Callable[[_Validator, Any, Any], bool]] = {
    "type": _has_type,
    "enum": lambda _, value, words: any(
        type(word) is type(value) and word == value for word in words
    ),
    "pattern": lambda _, value, pattern: (
        type(value) is not str or _compiled(pattern).search(value) is not None
    ),
    "minimum": lambda _, value, least: type(value) not in _NUMBERS or value >= least,
    "maximum": lambda _, value, most: type(value) not in _NUMBERS or value <= most,
    "exclusiveMinimum": lambda _, value, below: type(value) not in _NUMBERS or value > below,
    "minItems": lambda _, value, least: type(value) is not list or len(value) >= least,
    "minProperties": lambda _, value, least: type(value) is not dict or len(value) >= least,
    "required": lambda _, value, names: (
        type(value) is not dict or all(name in value for name in names)
    ),
    "anyOf": lambda self, value, parts: any(self.is_valid(value, part) for part in parts),
    "oneOf": lambda self, value, parts: sum(self.is_valid(value, part) for part in parts) == 1,
    "not": lambda self, value, part: not self.is_valid(value, part),
}
