"""The schemas themselves: valid, complete for editors, and the ones the shipped files keep to."""

from __future__ import annotations

import json
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator

from composer.base.folders import nodes_folder, schemas_folder, systems_folder
from composer.language.document import read_document
from composer.language.schema import SCHEMAS, check_schema, kind_of, schema
from composer.language.schema.explanations import KEYWORDS
from composer.language.tree import plain
from tests.unit.support.growth import assert_linear
from tests.unit.support.resolving import tree_of

SHIPPED = sorted([*systems_folder().glob("*.yaml"), *nodes_folder().glob("*.yaml")])
ANNOTATIONS = {"$schema", "title", "description", "default", "examples", "definitions"}
APPLICATORS = {"properties", "items", "allOf", "if", "then", "else", "$ref"}


def parts_of(part: Any) -> Iterator[dict[str, Any]]:
    """Yield every schema within a schema."""
    if not isinstance(part, dict):
        return
    yield part
    for name in ("items", "if", "then", "else", "additionalProperties", "not"):
        yield from parts_of(part.get(name))
    for name in ("allOf", "anyOf", "oneOf"):
        for item in part.get(name, ()):
            yield from parts_of(item)
    for name in ("properties", "definitions"):
        for item in part.get(name, {}).values():
            yield from parts_of(item)


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_schema_is_valid_and_made_from_its_parts(name: str) -> None:
    Draft7Validator.check_schema(schema(name))
    build = runpy.run_path(str(schemas_folder() / "build.py"))
    made = build["build"](name)
    assert build["path"](name).read_text() == made, "run 'python schemas/build.py'"


def test_a_definition_means_the_same_in_every_schema() -> None:
    node, system = (schema(name)["definitions"] for name in ("node", "system"))
    assert [name for name in node if name in system and node[name] != system[name]] == []


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_keyword_has_its_words_and_every_key_is_described(name: str) -> None:
    whole = schema(name)
    definitions = whole["definitions"]

    def described(part: dict[str, Any]) -> bool:
        reference = part.get("$ref", "").removeprefix("#/definitions/")
        return "description" in part or (reference != "" and described(definitions[reference]))

    used = {keyword for part in parts_of(whole) for keyword in part}
    assert used - ANNOTATIONS - APPLICATORS <= KEYWORDS
    bare = [
        f"{part.get('title')}: {key}"
        for part in parts_of(whole)
        for key, value in part.get("properties", {}).items()
        if not described(value)
    ]
    assert bare == []


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_map_of_keys_is_closed_and_examples_and_defaults_are_valid(name: str) -> None:
    whole = schema(name)
    for part in parts_of(whole):
        assert "properties" not in part or part.get("additionalProperties") is False, part
        values = [*part.get("examples", ()), *([part["default"]] if "default" in part else [])]
        validator = Draft7Validator({**part, "definitions": whole["definitions"]})
        for value in values:
            assert list(validator.iter_errors(value)) == [], part


def test_unknown_schema() -> None:
    with pytest.raises(KeyError):
        schema("../../etc/passwd")


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_shipped_file(path: Path) -> None:
    tree, _, diagnostics = read_document(path)
    kind = kind_of(tree)
    assert [item.message for item in (*diagnostics, *check_schema(tree, kind))] == []
    # An editor has plain JSON Schema, without the composer's stricter idea of an integer.
    assert Draft7Validator(schema(kind)).is_valid(plain(tree))
    # It finds the schema by the first line.
    first = path.read_text(encoding="utf-8").splitlines()[0]
    mark, _, reference = first.partition("=")
    assert mark == "# yaml-language-server: $schema"
    found = json.loads((path.parent / reference).read_text(encoding="utf-8"))
    assert found == schema(kind)


def large_system(nodes: int) -> str:
    lines = ["system: large", "nodes:"]
    for number in range(nodes):
        lines += [
            f"  node_{number}:",
            "    type: relay",
            "    variables: {message_type: std_msgs/msg/String}",
            "    parameters: {rate_hz: 10.0}",
        ]
    lines.append("connections:")
    for number in range(3 * nodes):
        ends = f"from: node_{number % nodes}.output, to: node_{(number + 1) % nodes}.input"
        lines.append(f"  - {{topic: /t{number}, {ends}}}")
    return "\n".join(lines)


@pytest.mark.slow  # 2000 nodes
@pytest.mark.parametrize(
    ("small", "large", "mistakes"),
    [(250, 2000, {}), (100, 800, {"type:": "typ:", "topic": "topc"})],
    ids=["valid", "mistakes everywhere"],
)
def test_costs_grow_in_proportion(small: int, large: int, mistakes: dict[str, str]) -> None:
    trees = {}
    for nodes in (small, large):
        text = large_system(nodes)
        for right, wrong in mistakes.items():
            text = text.replace(right, wrong)
        trees[nodes] = tree_of(text)
    assert (check_schema(trees[small], "system") == []) is not bool(mistakes)
    assert_linear(lambda nodes: check_schema(trees[nodes], "system"), small, large)
