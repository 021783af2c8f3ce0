from __future__ import annotations

import io
import math

import pytest
import yaml

from composer.cli.commands.topic_receive import without_items
from composer.cli.support.errors import UsageError
from composer.cli.support.options import yaml_or_stdin
from composer.cli.support.terminal import as_json, as_yaml, truncated


@pytest.mark.parametrize("value", [1.5, "text", "ends with...", True, None, [1, 2], {"a": ["b"]}])
def test_yaml_output_round_trips(value: object) -> None:
    text = as_yaml(value)
    assert yaml.safe_load(text) == value
    assert not text.endswith("\n")


def test_numbers_that_json_lacks_are_strings() -> None:
    values = {"ranges": [1.5, math.inf, -math.inf, math.nan]}
    assert as_json(values) == '{"ranges": [1.5, ".inf", "-.inf", ".nan"]}'


def test_long_lists_and_strings_are_truncated() -> None:
    assert truncated({"data": list(range(10))}, max_length=3) == {"data": [0, 1, 2, "... 10 items"]}
    assert truncated("abcdef", max_length=3) == "abc..."
    assert truncated(["abc", 5], max_length=3) == ["abc", 5]
    scan = {"ranges": [0.5, 1.5], "pose": {"x": 1.0}, "frame": "laser"}
    assert without_items(scan) == {**scan, "ranges": "<2 items>"}


def test_yaml_is_an_argument_or_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("data: hello\n"))
    assert yaml_or_stdin(None, stdin=False) == "{}"
    assert yaml_or_stdin("{x: 1}", stdin=False) == "{x: 1}"
    assert yaml_or_stdin(None, stdin=True) == "data: hello"
    monkeypatch.setattr("sys.stdin", io.StringIO("data: hello\n---\n"))  # of 'topic echo --once'
    assert yaml_or_stdin(None, stdin=True) == "data: hello"
    with pytest.raises(UsageError, match="not both"):
        yaml_or_stdin("{x: 1}", stdin=True)
