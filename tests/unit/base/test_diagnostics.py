"""Diagnostics: their order, and what they may echo, with escaped control characters."""

from __future__ import annotations

import pytest

from composer.base.characters import visible, width
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


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain", "plain"),
        ("café 日本", "café 日本"),
        ("a\tb", "a    b"),
        ("\x1b]0;owned\x07", "\\x1b]0;owned\\x07"),
        ("\u202egnp", "\\u202egnp"),
        ("a\u2028b", "a\\u2028b"),
        ("no\u00a0break, wide\u3000space", "no\\xa0break, wide\\u3000space"),
        ("\x9b31m", "\\x9b31m"),
        ("\U000e0001", "\\U000e0001"),
        ("\ud800", "\\ud800"),
        ("line\r\nline", "line\\r\\nline"),
    ],
)
def test_control_characters_are_escaped(text: str, expected: str) -> None:
    assert visible(text) == expected


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        *(("", 0), ("abc", 3), ("日本", 4), ("全角全角", 8), ("e\u0301", 1), ("\t", 4)),
        *(("\x1b", 4), ("한글 text", 9)),
    ],
)
def test_width_is_in_terminal_cells(text: str, cells: int) -> None:
    assert width(text) == cells


def at(path: str, line: int, column: int) -> Diagnostic:
    return Diagnostic(RULE, "same words", Span(SourceFile(path), line, column))


def test_each_diagnostic_is_shown_once_in_the_order_of_the_files() -> None:
    diagnostics = [at("b", 1, 1), at("a", 10, 1), at("a", 2, 30), at("a", 2, 4), at("a", 2, 4)]
    diagnostics.append(at("a", 1, 1))  # the same place of another file
    assert [str(diagnostic.primary) for diagnostic in in_order(diagnostics)] == [
        "a:1:1", "a:2:4", "a:2:30", "a:10:1", "b:1:1",
    ]  # fmt: skip
