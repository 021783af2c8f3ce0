"""Characters that control a terminal, change the direction of text, or are invisible."""

from __future__ import annotations

import json
import re

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


def is_safe(text: str) -> bool:
    """Return whether ``text`` has no unsafe characters; line feeds and tabs are safe."""
    return UNSAFE_IN_LINES.search(text) is None


def escape_lines(text: str) -> str:
    """Return ``text`` with unsafe characters escaped as in Python, but not line feeds and tabs."""
    return UNSAFE_IN_LINES.sub(_escape, text)


def escape_line(text: str) -> str:
    """Return ``text``, which belongs on one line, with line feeds and tabs escaped as well."""
    return _UNSAFE_IN_LINE.sub(_escape, text)


def escape_json(text: str) -> str:
    """Return the JSON ``text`` with the unsafe characters of its strings escaped as in JSON."""
    return UNSAFE_IN_LINES.sub(lambda found: json.dumps(found[0])[1:-1], text)


def _escape(found: re.Match[str]) -> str:
    return repr(found[0])[1:-1]
