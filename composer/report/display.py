"""Text in a terminal: escaping of unsafe characters, and display width."""

from __future__ import annotations

import unicodedata

TAB = "    "

#: Control and format characters (such as bidi overrides), surrogates, private use, line separators,
#: and spaces that look like the one that YAML accepts.
_UNSAFE_CATEGORIES = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp", "Zs"})
_ZERO_WIDTH_CATEGORIES = frozenset({"Mn", "Me"})


def visible(text: str) -> str:
    """Return ``text`` with tabs as spaces and control characters escaped."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(_visible_character(character) for character in text)


def width(text: str) -> int:
    """Return the width of ``visible(text)`` in terminal cells.

    Wide characters take two cells (UAX #11), combining ones none.
    """
    shown = visible(text)
    return len(shown) if shown.isascii() else sum(map(_cells, shown))


def _visible_character(character: str) -> str:
    if character == "\t":
        return TAB
    if character == " " or unicodedata.category(character) not in _UNSAFE_CATEGORIES:
        return character
    code = ord(character)
    if code <= 0xFF:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code <= 0xFFFF else f"\\U{code:08x}"


def _cells(character: str) -> int:
    if unicodedata.category(character) in _ZERO_WIDTH_CATEGORIES:
        return 0
    return 2 if unicodedata.east_asian_width(character) in {"W", "F"} else 1
