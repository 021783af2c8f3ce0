"""The schema check finds the errors that jsonschema finds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft7Validator
from jsonschema.validators import extend

from composer.base.folders import nodes_folder, systems_folder
from composer.language.document import read_document
from composer.language.schema import SCHEMAS, schema
from composer.language.schema.validation import schema_errors
from composer.language.tree import plain
from tests.examples import examples
from tests.properties.mutation import mutated

ROOT = Path(__file__).parents[2]
STRICT = extend(
    Draft7Validator,
    type_checker=Draft7Validator.TYPE_CHECKER.redefine(
        "integer", lambda _, value: isinstance(value, int) and not isinstance(value, bool)
    ),
)
VALIDATORS = {name: STRICT(schema(name)) for name in SCHEMAS}
FILES = [
    plain(tree)
    for folder in (systems_folder(), nodes_folder(), ROOT / "scenarios")
    for path in sorted(folder.glob("*.yaml"))
    for tree, _, _ in [read_document(path)]
    if tree is not None
]


@examples(400)
@given(st.sampled_from(FILES).flatmap(mutated))
def test_on_mutated_files(content: Any) -> None:
    for name in SCHEMAS:
        reference = VALIDATORS[name].iter_errors(content)
        expected = [(tuple(error.absolute_path), error.validator) for error in reference]
        errors = [(error.path, error.keyword) for error in schema_errors(content, schema(name))]
        # jsonschema reports each missing key on its own, and unnamed keys in the order of a set.
        assert set(errors) == set(expected)


@pytest.mark.parametrize(
    ("part", "valid", "invalid"),
    [
        ({"type": "integer"}, [1, -1], [1.0, True, "1", None]),
        ({"type": ["number", "null"]}, [1, 1.5, None], [True, "1", [], {}]),
        ({"enum": ["a", 1]}, ["a", 1], ["b", True, 1.5, None, [], {}]),
        ({"pattern": "^a"}, ["ab", 1, None], ["ba", ""]),
        ({"minimum": 1}, [1, 2.5, "0", True], [0, 0.5]),
        ({"exclusiveMinimum": 1}, [1.5, "0", True], [1, 0.5]),
        ({"minItems": 1}, [[1], {}, ""], [[]]),
        ({"minProperties": 1}, [{"a": 1}, [], ""], [{}]),
        ({"required": ["a"]}, [{"a": None}, [], "a"], [{"b": 1}, {}]),
        ({"properties": {"a": {"type": "string"}}}, [{"a": "b"}, {"b": 1}, []], [{"a": 1}]),
        ({"additionalProperties": False}, [{}, []], [{"a": 1}]),
        (
            {"properties": {"a": {}}, "additionalProperties": {"type": "string"}},
            [{"a": 1, "b": "c"}],
            [{"a": 1, "b": 2}],
        ),
        ({"items": {"type": "string"}}, [[], ["a"], {}], [["a", 1]]),
        ({"allOf": [{"minimum": 1}, {"type": "integer"}]}, [1], [0, 1.5]),
        ({"anyOf": [{"minimum": 5}, {"type": "integer"}]}, [1, 5.5], [1.5]),
        ({"oneOf": [{"minimum": 5}, {"type": "integer"}]}, [1, 5.5], [1.5, 5]),
        ({"not": {"type": "string"}}, [1, None], ["a"]),
        (
            {"if": {"type": "string"}, "then": {"pattern": "a"}, "else": {"minimum": 1}},
            ["a", 1, None],
            ["b", 0],
        ),
        ({"if": {"type": "string"}, "else": {"minimum": 1}}, ["a", 1], [0]),
        ({}, [None, 1, "a", [], {}], []),
    ],
)
def test_keyword(part: dict[str, Any], valid: list[Any], invalid: list[Any]) -> None:
    reference = STRICT(part)
    for values, is_valid in ((valid, True), (invalid, False)):
        for value in values:
            assert (not [*schema_errors(value, part)]) is is_valid, value
            assert reference.is_valid(value) is is_valid, value


def test_an_unknown_keyword_is_an_error() -> None:
    with pytest.raises(KeyError):
        list(schema_errors([], {"uniqueItems": True}))
