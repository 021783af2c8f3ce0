from __future__ import annotations

import json

import pytest

from tests.cli.compose import compose


@pytest.mark.parametrize("name", ["RC202", "rc202", "unknown-node"])
def test_a_rule_is_found_by_code_or_name(name: str) -> None:
    done = compose("rule", name)
    assert done.code == 0
    assert done.out.startswith("RC202 unknown-node (error)\n")
    assert "Use instead" in done.out


def test_all_rules_are_listed() -> None:
    lines = compose("rule").out.splitlines()
    assert any(line.split() == ["RC202", "error", "unknown-node"] for line in lines)
    assert lines == sorted(lines)


def test_a_band_of_rules_is_listed() -> None:
    done = compose("rule", "RC32")
    assert (done.code, done.err) == (0, "")
    codes = [line.split()[0] for line in done.out.splitlines()]
    assert "RC324" in codes
    assert all(code.startswith("RC32") for code in codes)


def test_an_unknown_rule_gets_a_suggestion() -> None:
    done = compose("rule", "unknown-nodes")
    assert done.code == 2
    assert "did you mean 'unknown-node'?" in done.err


@pytest.mark.parametrize("name", ["system", "node", "project", "report"])
def test_a_schema_is_printed_as_json(name: str) -> None:
    content = json.loads(compose("schema", name).out)
    assert "draft-07" in content["$schema"]


def test_an_unknown_schema_is_a_usage_error() -> None:
    assert compose("schema", "nodes").code == 2
