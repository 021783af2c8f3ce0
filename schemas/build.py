"""Build the JSON Schemas from ``parts/*.yaml``: ``python schemas/build.py``.

Editors need each schema in a single file, but the schemas share most of their definitions. Each
schema therefore gets the definitions of ``parts/shared.yaml`` that it references.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from composer.language.document import read_document
from composer.language.tree import plain

FOLDER = Path(__file__).resolve().parent
NAMES = ("system", "node", "project", "scenario")
_DEFINITIONS = "#/definitions/"
_CONDITIONS = ("for_each", "if", "unless")


def build(name: str) -> str:
    """Return the text of a schema."""
    schema = _read(name)
    definitions = _joined(_read("shared"), schema.pop("definitions"))
    if name == "scenario":  # it overrides entries of a system
        definitions = _joined(_read("system")["definitions"], definitions)
        _add_keys(definitions["expectation"], definitions["condition"])
    if "executor" in definitions:
        definitions["overridden_executor"] = _unconditional(definitions["executor"])
    needed = sorted(_reachable(schema, definitions))
    schema["definitions"] = {definition: definitions[definition] for definition in needed}
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def path(name: str) -> Path:
    """Return the path of a schema file."""
    return FOLDER / f"{name}.schema.json"


def _read(part: str) -> dict[str, Any]:
    tree, _, diagnostics = read_document(FOLDER / "parts" / f"{part}.yaml")
    if tree is None or diagnostics:
        raise SystemExit("\n".join(f"{item.primary}: {item.message}" for item in diagnostics))
    content: dict[str, Any] = plain(tree)
    return content


def _joined(first: dict[str, Any], second: dict[str, Any]) -> dict[str, Any]:
    """Return the definitions of both, which must not define the same name."""
    twice = sorted(first.keys() & second.keys())
    if twice:
        raise SystemExit(f"defined twice in {FOLDER / 'parts'}: {', '.join(twice)}")
    return {**first, **second}


def _unconditional(part: dict[str, Any]) -> dict[str, Any]:
    """Return a map without the keys that decide whether it is there."""
    keys = {key: value for key, value in part["properties"].items() if key not in _CONDITIONS}
    return {**part, "properties": keys}


def _add_keys(part: dict[str, Any], other: dict[str, Any]) -> None:
    """Add the keys of another map to a map."""
    part["properties"] = {**other["properties"], **part["properties"]}


def _reachable(schema: dict[str, Any], definitions: dict[str, Any]) -> set[str]:
    reachable: set[str] = set()
    waiting = list(_references(schema))
    while waiting:
        name = waiting.pop()
        if name not in reachable:
            reachable.add(name)
            waiting.extend(_references(definitions[name]))
    return reachable


def _references(part: Any) -> Iterator[str]:
    if isinstance(part, dict):
        for key, value in part.items():
            if key == "$ref":
                yield value.removeprefix(_DEFINITIONS)
            else:
                yield from _references(value)
    elif isinstance(part, list):
        for item in part:
            yield from _references(item)


if __name__ == "__main__":
    for schema_name in NAMES:
        path(schema_name).write_text(build(schema_name), encoding="utf-8")
