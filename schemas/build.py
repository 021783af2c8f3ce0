"""Make the schemas from their parts: ``python schemas/build.py``.

Editors want each schema in one file; the two share most of their definitions. So people edit
``parts/*.yaml``, and this puts what a schema needs of ``parts/shared.yaml`` into it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from composer.document import read_document
from composer.tree import plain

FOLDER = Path(__file__).resolve().parent
NAMES = ("system", "node", "project")
_DEFINITIONS = "#/definitions/"


def build(name: str) -> str:
    """Return the text of the schema called ``name``."""
    schema = _read(name)
    definitions = {**_read("shared"), **schema.pop("definitions")}
    needed = sorted(_reachable(schema, definitions))
    schema["definitions"] = {definition: definitions[definition] for definition in needed}
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def path(name: str) -> Path:
    """Return where the schema called ``name`` is kept."""
    return FOLDER / f"{name}.schema.json"


def _read(part: str) -> dict[str, Any]:
    tree, _, findings = read_document(FOLDER / "parts" / f"{part}.yaml")
    if tree is None or findings:
        raise SystemExit("\n".join(f"{item.primary}: {item.message}" for item in findings))
    content: dict[str, Any] = plain(tree)
    return content


def _reachable(schema: dict[str, Any], definitions: dict[str, Any]) -> set[str]:
    found: set[str] = set()
    waiting = list(_references(schema))
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(_references(definitions[name]))
    return found


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
