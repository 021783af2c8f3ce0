"""The parser of Foxglove reads every schema as intended.

Requires Node.js and ``npm ci --prefix tests/foxglove``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from composer.dashboard.foxglove.encoding import Schemas
from composer.interfaces import Interfaces, Message
from tests.programs import require_package, run_node

HERE = Path(__file__).parent

#: What the parser calls these types.
SAME = {
    "builtin_interfaces/Time": "time",
    "builtin_interfaces/Duration": "duration",
    "byte": "uint8",
}


@pytest.fixture(scope="module", autouse=True)
def parser() -> None:
    require_package(HERE, "@foxglove/rosmsg")


def fields(message: Message) -> list[tuple[str, str, bool, Any]]:
    found = []
    for field in message.fields:
        name = field.type.name
        short = name if field.type.is_primitive else name.replace("/msg/", "/")
        limit = field.type.array_size or field.type.array_bound
        found.append((field.name, SAME.get(short, short), field.type.is_array, limit))
    return found


def parsed_fields(definition: Any) -> list[tuple[str, str, bool, Any]]:
    return [
        (
            item["name"],
            SAME.get(item["type"], item["type"]),
            bool(item.get("isArray")),
            item.get("arrayLength") or item.get("arrayUpperBound"),
        )
        for item in definition["definitions"]
        if not item.get("isConstant")
    ]


def test_every_known_message() -> None:
    interfaces = Interfaces.load()
    schemas = Schemas(interfaces)
    texts = {name: schemas.message(name) for name in interfaces.names("msg")}
    known = {name: text for name, text in texts.items() if text is not None}
    assert len(known) > 200
    assert len(known) == len(texts)
    for name, parsed in run_node(HERE, "read.mjs", known).items():
        assert "error" not in parsed, (name, parsed, known[name])
        message = interfaces.message(name)
        assert message is not None
        assert parsed_fields(parsed[0]) == fields(message), name
        constants = {
            item["name"]: item["value"]
            for item in parsed[0]["definitions"]
            if item.get("isConstant")
        }
        assert constants == {item.name: item.value for item in message.constants}, name


def test_every_known_service() -> None:
    interfaces = Interfaces.load()
    schemas = Schemas(interfaces)
    known = {}
    for name in interfaces.names("srv"):
        found = schemas.service(name)
        assert found is not None, name
        known[f"{name} request"], known[f"{name} response"] = found
    assert len(known) > 100
    parsed = run_node(HERE, "read.mjs", known)
    assert {name: found for name, found in parsed.items() if "error" in found} == {}
