"""Diagnostics: their order, and what they may echo."""

from __future__ import annotations

import pytest

from composer.base.diagnostics import (
    MAXIMUM_VALUE_LENGTH,
    Diagnostic,
    Rule,
    Severity,
    in_order,
    shown,
)
from composer.base.source import SourceFile, Span

RULE = Rule("RC999", "example", Severity.ERROR)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("planner", "planner"),
        ("größe 値段 😀", "größe 値段 😀"),
        ("\x1b]0;pwn\x07", "\\x1b]0;pwn\\x07"),
        ("a\u202eb\nc", "a\\u202eb\\nc"),
        ("\U000e0041", "\\U000e0041"),
        ("a\\b'c", "a\\b'c"),
        (None, "null"),
        (True, "true"),
        (False, "false"),
        (1, "1"),
        (0.5, "0.5"),
    ],
)
def test_shown(value: object, text: str) -> None:
    assert shown(value) == text


def test_shown_is_cut() -> None:
    assert shown("x" * MAXIMUM_VALUE_LENGTH) == "x" * MAXIMUM_VALUE_LENGTH
    assert shown("x" * 1_000_000) == "x" * (MAXIMUM_VALUE_LENGTH - 3) + "..."
    assert shown("abcdef", limit=5) == "ab..."


def at(path: str, line: int, column: int) -> Diagnostic:
    return Diagnostic(RULE, "same words", Span(SourceFile(path), line, column))


def test_order_is_that_of_the_files() -> None:
    diagnostics = [at("b", 1, 1), at("a", 10, 1), at("a", 2, 30), at("a", 2, 4)]
    assert [str(diagnostic.primary) for diagnostic in in_order(diagnostics)] == [
        "a:2:4", "a:2:30", "a:10:1", "b:1:1",
    ]  # fmt: skip


def test_each_diagnostic_once() -> None:
    assert len(in_order([at("a", 1, 1), at("a", 1, 1)])) == 1


def test_same_place_of_two_files_is_two_places() -> None:
    diagnostics = in_order([at("b", 1, 1), at("a", 1, 1)])
    assert [diagnostic.primary.file.path for diagnostic in diagnostics] == ["a", "b"]
