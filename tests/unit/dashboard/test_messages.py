"""Requests of browsers, and JSON for them."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.dashboard.protocol.messages import BadRequestError, Values, parse_request, to_json


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "not valid JSON"),
        ("{", "not valid JSON"),
        ("[" * 100_000, "not valid JSON"),
        ('{"id": 1, "op": "call", "request": {"x": NaN}}', "NaN is not a number in JSON"),
        ("[]", "not a JSON object"),
        ('{"op": "ping"}', "'id' must be"),
        ('{"id": true, "op": "ping"}', "'id' must be"),
        ('{"id": [1], "op": "ping"}', "'id' must be"),
        (f'{{"id": "{"x" * 100}", "op": "ping"}}', "'id' must be"),
        ('{"id": 1}', "'op' must be a string"),
        ('{"id": 1, "op": 5}', "'op' must be a string"),
    ],
)
def test_a_malformed_request_says_why(text: str, reason: str) -> None:
    with pytest.raises(BadRequestError, match=reason):
        parse_request(text)


@given(st.text() | st.binary().map(lambda data: data.decode("latin-1")))
def test_any_text_is_a_request_or_an_error(text: str) -> None:
    with suppress(BadRequestError):
        assert parse_request(text).op


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ({}, "needs 'topic', a string"),
        ({"topic": 5}, "'topic' must be a string"),
        ({"topic": "/a", "hz": "fast"}, "'hz' must be a number"),
        ({"topic": "/a", "hz": True}, "'hz' must be a number"),
        ({"topic": "/a", "hz": 1e99}, "'hz' must be from 1 to 10"),
        ({"topic": "/a", "fields": "x"}, "'fields' must be an array"),
        ({"topic": "/a", "fields": [1]}, "'fields' must be an array of strings"),
        ({"topic": "/a", "fields": ["x"] * 5}, "5 items, at most 3"),
        ({"topic": "/a", "field": []}, "has no key 'field'"),
    ],
)
def test_keys_are_checked(content: dict[str, Any], reason: str) -> None:
    def read(values: Values) -> None:
        values.text("topic")
        values.number("hz", 5.0, 1.0, 10.0)
        values.texts("fields", 3)
        values.end()

    with pytest.raises(BadRequestError, match=reason) as caught:
        read(Values(content, "'echo'"))
    assert caught.value.hint == ("did you mean 'fields'?" if "field" in content else None)


def test_numbers_that_javascript_lacks_become_text_and_any_text_is_valid() -> None:
    value = {"a": float("nan"), "b": [float("inf"), -float("inf")], "c": 2**60, "d": 1.5}
    text = "\udcff\u2028</script>\x00"
    assert json.loads(to_json(value | {"e": 2**53, "f": text})) == {
        "a": ".nan",
        "b": [".inf", "-.inf"],
        "c": str(2**60),
        "d": 1.5,
        "e": 2**53,
        "f": text,
    }
