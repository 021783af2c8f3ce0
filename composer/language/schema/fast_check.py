"""Check whether a value is valid against a schema, and nothing more.

Most files are valid, and this check takes a fraction of the time that importing jsonschema takes.
jsonschema then reports where and why an invalid file is wrong. A test compares the results of the
two.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import field
from typing import Any, TypeAlias

from composer.base.fast_dataclass import dataclass

#: Returns whether a value is valid.
Check: TypeAlias = Callable[[Any], bool]

_DEFINITIONS = "#/definitions/"


def compile_check(schema: dict[str, Any]) -> Check:
    """Return the check for a schema (draft-07). Raises KeyError for an unsupported keyword."""
    return _Compiler(schema.get("definitions", {})).test(schema)


@dataclass(slots=True)
class _Compiler:
    """Compiles schemas to checks, each definition once."""

    definitions: dict[str, Any]
    _made: dict[str, Check] = field(default_factory=dict)

    def test(self, schema: dict[str, Any]) -> Check:
        if "$ref" in schema:
            name = schema["$ref"].removeprefix(_DEFINITIONS)
            if name not in self._made:
                self._made[name] = self.test(self.definitions[name])
            return self._made[name]
        compilers = [_KEYWORDS[keyword] for keyword in schema]
        return _all(
            checks
            for compile_keyword in dict.fromkeys(compilers)
            for checks in compile_keyword(self, schema)
        )


def _nothing(_: _Compiler, __: dict[str, Any]) -> Iterable[Check]:
    return ()


def _type(_: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    allowed = schema["type"]
    kinds = frozenset(
        python
        for name in ([allowed] if isinstance(allowed, str) else allowed)
        for python in _PYTHON_TYPES[name]
    )
    yield lambda value: type(value) in kinds


def _enum(_: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    words = tuple((type(word), word) for word in schema["enum"])
    yield lambda value: (type(value), value) in words


def _pattern(_: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    search = re.compile(schema["pattern"]).search
    yield lambda value: type(value) is not str or search(value) is not None


def _limits(_: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    if "minimum" in schema:
        least = schema["minimum"]
        yield lambda value: type(value) not in _NUMBERS or value >= least
    if "maximum" in schema:
        most = schema["maximum"]
        yield lambda value: type(value) not in _NUMBERS or value <= most
    if "exclusiveMinimum" in schema:
        below = schema["exclusiveMinimum"]
        yield lambda value: type(value) not in _NUMBERS or value > below


def _sizes(_: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    if "minItems" in schema:
        items = schema["minItems"]
        yield lambda value: type(value) is not list or len(value) >= items
    if "minProperties" in schema:
        entries = schema["minProperties"]
        yield lambda value: type(value) is not dict or len(value) >= entries


def _required(_: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    names = frozenset(schema["required"])
    yield lambda value: type(value) is not dict or names <= value.keys()


def _keys(compiler: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    known = {name: compiler.test(part) for name, part in schema.get("properties", {}).items()}
    others = schema.get("additionalProperties", True)
    other = compiler.test(others) if isinstance(others, dict) else lambda _: bool(others)

    def test(value: Any) -> bool:
        if type(value) is not dict:
            return True
        return all(known.get(name, other)(inner) for name, inner in value.items())

    yield test


def _items(compiler: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    item = compiler.test(schema["items"])
    yield lambda value: type(value) is not list or all(map(item, value))


def _every(compiler: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    return [compiler.test(part) for part in schema["allOf"]]


def _some(compiler: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    parts = [compiler.test(part) for part in schema["anyOf"]]
    yield lambda value: any(part(value) for part in parts)


def _one(compiler: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    parts = [compiler.test(part) for part in schema["oneOf"]]
    yield lambda value: sum(part(value) for part in parts) == 1


def _not(compiler: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    part = compiler.test(schema["not"])
    yield lambda value: not part(value)


def _if(compiler: _Compiler, schema: dict[str, Any]) -> Iterable[Check]:
    condition = compiler.test(schema["if"])
    then, otherwise = compiler.test(schema.get("then", {})), compiler.test(schema.get("else", {}))
    yield lambda value: then(value) if condition(value) else otherwise(value)


def _all(checks: Iterable[Check]) -> Check:
    tests = tuple(checks)
    return tests[0] if len(tests) == 1 else lambda value: all(test(value) for test in tests)


_NUMBERS = frozenset({int, float})
_PYTHON_TYPES: dict[str, tuple[type, ...]] = {
    "object": (dict,),
    "array": (list,),
    "string": (str,),
    "number": (int, float),
    "integer": (int,),
    "boolean": (bool,),
    "null": (type(None),),
}

_KEYWORDS: dict[str, Callable[[_Compiler, dict[str, Any]], Iterable[Check]]] = {
    **dict.fromkeys(("$schema", "title", "description", "default", "examples"), _nothing),
    **dict.fromkeys(("definitions", "then", "else"), _nothing),
    **dict.fromkeys(("minimum", "maximum", "exclusiveMinimum"), _limits),
    **dict.fromkeys(("minItems", "minProperties"), _sizes),
    **dict.fromkeys(("properties", "additionalProperties"), _keys),
    "type": _type,
    "enum": _enum,
    "pattern": _pattern,
    "required": _required,
    "items": _items,
    "allOf": _every,
    "anyOf": _some,
    "oneOf": _one,
    "not": _not,
    "if": _if,
}
