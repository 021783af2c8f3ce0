from __future__ import annotations

import pytest
import yaml

from composer.cli.commands.topic.message_format import truncated
from composer.cli.support.output import as_yaml
from composer.cli.support.terminal import columns


@pytest.mark.parametrize("value", [1.5, "text", "ends with...", True, None, [1, 2], {"a": ["b"]}])
def test_yaml_output_round_trips(value: object) -> None:
    text = as_yaml(value)
    assert yaml.safe_load(text) == value
    assert not text.endswith("\n")


def test_long_lists_and_strings_are_truncated() -> None:
    assert truncated({"data": list(range(10))}, max_length=3) == {"data": [0, 1, 2, "... 10 items"]}
    assert truncated("abcdef", max_length=3) == "abc..."
    assert truncated(["abc", 5], max_length=3) == ["abc", 5]


def test_columns_are_aligned_and_numbers_right_aligned() -> None:
    rows = [("node", "sent"), ("/a/long/name", "7"), ("/b", "123")]
    assert columns(rows, numbers_from=1) == (
        "node          sent\n/a/long/name     7\n/b             123"
    )
    assert columns([("a", "b"), ("cc", "")]) == "a   b\ncc"
