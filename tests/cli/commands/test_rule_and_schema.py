"""``compose validate --explain`` and ``compose export schema``."""

from __future__ import annotations

import json

import pytest

from composer.language.schema import REPORT, SCHEMAS
from tests.cli.compose import compose


def test_rules_are_explained_by_code_or_name_and_listed_by_prefix() -> None:
    for name in ("RC202", "rc202", "unknown-node"):
        done = compose("validate", "--explain", name)
        assert done.code == 0
        assert done.out.startswith("RC202 unknown-node (error)\n")
        assert "Use instead" in done.out
    lines = compose("validate", "--explain", "RC").out.splitlines()
    assert ["RC202", "error", "unknown-node"] in [line.split() for line in lines]
    assert lines == sorted(lines)
    some = compose("validate", "--explain", "rc32").out.splitlines()
    assert some == [line for line in lines if line.startswith("RC32")]
    done = compose("validate", "--explain", "unknown-nodes")
    assert done.code == 2
    assert "did you mean 'unknown-node'?" in done.err


@pytest.mark.parametrize("name", [*SCHEMAS, REPORT])
def test_a_schema_is_printed_as_json(name: str) -> None:
    content = json.loads(compose("export", "schema", name).out)
    assert "draft-07" in content["$schema"]
    assert compose("export", "schema", "nodes").code == 2
