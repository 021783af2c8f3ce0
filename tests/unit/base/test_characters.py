"""Escaping of control characters, and display width."""

from __future__ import annotations

import pytest

from composer.base.characters import visible, width


@pytest.mark.parametrize(
    ("text", "shown"),
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
def test_control_characters_are_escaped(text: str, shown: str) -> None:
    assert visible(text) == shown


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        ("", 0),
        ("abc", 3),
        ("日本", 4),
        ("全角全角", 8),
        ("e\u0301", 1),
        ("\t", 4),
        ("\x1b", 4),
        ("한글 text", 9),
    ],
)
def test_width_is_in_terminal_cells(text: str, cells: int) -> None:
    assert width(text) == cells
