"""Text for a terminal: its width, numbers with their nouns, lists of names, and unsafe characters.

Unsafe are characters that control a terminal, change the direction of text, or are invisible.
"""

from __future__ import annotations

import json
import re
import unicodedata
from collections.abc import Sequence

#: For a character class of re: characters that change the direction of text or are invisible.
INVISIBLE = "\u061c\u200b\u200e\u200f\u202a-\u202e\u2060-\u2069"
#: The same with controls (all but tab and line ends), characters that end a line for YAML 1.1 only,
#: half surrogate pairs, byte-order marks inside the text, and noncharacters.
UNSAFE = (
    "\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f"
    f"{INVISIBLE}\u2028\u2029"
    "\ud800-\udfff\ufeff\ufff9-\ufffb\ufffe\uffff\U000e0000-\U000e007f"
)
#: Matches a character that is unsafe in a text of several lines.
UNSAFE_IN_LINES = re.compile(f"[{UNSAFE}\r]")
_UNSAFE_IN_LINE = re.compile(f"[{UNSAFE}\r\n\t]")

_ZERO_WIDTH_CATEGORIES = frozenset({"Mn", "Me"})
_TAB = "    "


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: ``1 error``, ``2 errors``."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def shortened(names: Sequence[str], most: int) -> str:
    """Return names as one text, at most so many: ``a, b and 3 more``."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{', '.join(names[:most])}{more}"


def is_safe(text: str) -> bool:
    """Return whether ``text`` has no unsafe characters; line feeds and tabs are safe."""
    return UNSAFE_IN_LINES.search(text) is None


def escape_lines(text: str) -> str:
    """Return ``text`` with unsafe characters escaped as in Python, but not line feeds and tabs."""
    return UNSAFE_IN_LINES.sub(lambda found: _escaped(found[0]), text)


def escape_line(text: str) -> str:
    """Return ``text``, which belongs on one line, with line feeds and tabs escaped as well."""
    return _UNSAFE_IN_LINE.sub(lambda found: _escaped(found[0]), text)


def escape_json(text: str) -> str:
    """Return the JSON ``text`` with the unsafe characters of its strings escaped as in JSON."""
    return UNSAFE_IN_LINES.sub(lambda found: json.dumps(found[0])[1:-1], text)


def visible(text: str) -> str:
    """Return ``text`` for a terminal, with tabs as spaces and unprintable characters escaped.

    Unprintable are also spaces that look like the one that YAML accepts.
    """
    if text.isprintable():
        return text
    return "".join(
        _TAB if character == "\t" else character if character.isprintable() else _escaped(character)
        for character in text
    )


def width(text: str) -> int:
    """Return the width of ``visible(text)`` in terminal cells.

    Wide characters take two cells (UAX #11), combining ones none.
    """
    shown = visible(text)
    return len(shown) if shown.isascii() else sum(map(_cells, shown))


def _cells(character: str) -> int:
    if unicodedata.category(character) in _ZERO_WIDTH_CATEGORIES:
        return 0
    return 2 if unicodedata.east_asian_width(character) in {"W", "F"} else 1


def _escaped(character: str) -> str:
    return repr(character)[1:-1]
