"""Whether a value has the shape that a schema wants, and nothing more.

Nearly every file has it, and to see that takes a fraction of the time that jsonschema takes to be
imported alone. Where and why a file has it not is left to jsonschema to say; a test holds the two
against each other.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, TypeAlias

#: Says whether a value is right.
Test: TypeAlias = Callable[[Any], bool]

_DEFINITIONS = "#/definitions/"


def shape(whole: dict[str, Any]) -> Test:
    """Return the test for a schema (draft-07). Raises KeyError for a keyword not known here."""
    return _Shapes(whole.get("definitions", {})).test(whole)


@dataclass(slots=True)
class _Shapes:
    """Makes tests; that of a definition once, however often it is referred to."""

    definitions: dict[str, Any]
    _made: dict[str, Test] = field(default_factory=dict)

    def test(self, schema: dict[str, Any]) -> Test:
        if "$ref" in schema:
            name = schema["$ref"].removeprefix(_DEFINITIONS)
            if name not in self._made:
                self._made[name] = self.test(self.definitions[name])
            return self._made[name]
        makers = [_MAKERS[keyword] for keyword in schema]
        return _all(made for maker in dict.fromkeys(makers) for made in maker(self, schema))


def _nothing(_: _Shapes, __: dict[str, Any]) -> Iterable[Test]:
    return ()


def _type(_: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    wanted = schema["type"]
    kinds = frozenset(
        python
        for name in ([wanted] if isinstance(wanted, str) else wanted)
        for python in _PYTHON_TYPES[name]
    )
    yield lambda value: type(value) in kinds


def _enum(_: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    words = tuple((type(word), word) for word in schema["enum"])
    yield lambda value: (type(value), value) in words


def _pattern(_: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    search = re.compile(schema["pattern"]).search
    yield lambda value: type(value) is not str or search(value) is not None


def _limits(_: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    if "minimum" in schema:
        least = schema["minimum"]
        yield lambda value: type(value) not in _NUMBERS or value >= least
    if "maximum" in schema:
        most = schema["maximum"]
        yield lambda value: type(value) not in _NUMBERS or value <= most
    if "exclusiveMinimum" in schema:
        below = schema["exclusiveMinimum"]
        yield lambda value: type(value) not in _NUMBERS or value > below


def _sizes(_: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    if "minItems" in schema:
        items = schema["minItems"]
        yield lambda value: type(value) is not list or len(value) >= items
    if "minProperties" in schema:
        entries = schema["minProperties"]
        yield lambda value: type(value) is not dict or len(value) >= entries


def _required(_: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    names = frozenset(schema["required"])
    yield lambda value: type(value) is not dict or names <= value.keys()


def _keys(shapes: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    known = {name: shapes.test(part) for name, part in schema.get("properties", {}).items()}
    others = schema.get("additionalProperties", True)
    other = shapes.test(others) if isinstance(others, dict) else lambda _: bool(others)

    def test(value: Any) -> bool:
        if type(value) is not dict:
            return True
        return all(known.get(name, other)(inner) for name, inner in value.items())

    yield test


def _items(shapes: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    item = shapes.test(schema["items"])
    yield lambda value: type(value) is not list or all(map(item, value))


def _every(shapes: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    return [shapes.test(part) for part in schema["allOf"]]


def _some(shapes: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    parts = [shapes.test(part) for part in schema["anyOf"]]
    yield lambda value: any(part(value) for part in parts)


def _not(shapes: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    part = shapes.test(schema["not"])
    yield lambda value: not part(value)


def _if(shapes: _Shapes, schema: dict[str, Any]) -> Iterable[Test]:
    condition = shapes.test(schema["if"])
    then, otherwise = shapes.test(schema.get("then", {})), shapes.test(schema.get("else", {}))
    yield lambda value: then(value) if condition(value) else otherwise(value)


def _all(made: Iterable[Test]) -> Test:
    tests = tuple(made)
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

_MAKERS: dict[str, Callable[[_Shapes, dict[str, Any]], Iterable[Test]]] = {
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
    "not": _not,
    "if": _if,
}
