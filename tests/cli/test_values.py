from __future__ import annotations

import pytest
import yaml

from composer.cli.support.terminal import columns
from composer.cli.support.values import as_yaml, cut


@pytest.mark.parametrize("value", [1.5, "text", "ends with...", True, None, [1, 2], {"a": ["b"]}])
def test_values_are_written_as_yaml_that_reads_back(value: object) -> None:
    text = as_yaml(value)
    assert yaml.safe_load(text) == value
    assert not text.endswith("\n")


def test_long_lists_and_texts_are_cut_and_say_so() -> None:
    assert cut({"data": list(range(10))}, longest=3) == {"data": [0, 1, 2, "... 10 items"]}
    assert cut("abcdef", longest=3) == "abc..."
    assert cut(["abc", 5], longest=3) == ["abc", 5]


def test_columns_are_aligned_and_numbers_stand_on_the_right() -> None:
    rows = [("node", "sent"), ("/a/long/name", "7"), ("/b", "123")]
    assert columns(rows, numbers_from=1) == (
        "node          sent\n/a/long/name     7\n/b             123"
    )
    assert columns([("a", "b"), ("cc", "")]) == "a   b\ncc"
