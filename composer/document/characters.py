"""Check for forbidden characters."""

from __future__ import annotations

import re
import unicodedata

from composer.characters import INVISIBLE, UNSAFE, UNSAFE_IN_LINES
from composer.diagnostics import Diagnostic
from composer.document.rules import FORBIDDEN_CHARACTER
from composer.source import SourceFile, Span

_FORBIDDEN_IN_TEXT = re.compile(f"[{UNSAFE}]")
_FORBIDDEN_UNLESS_INVISIBLE = re.compile(f"(?![{INVISIBLE}])[{UNSAFE}]")


def check_text(source: SourceFile, *, may_be_invisible: bool) -> list[Diagnostic]:
    """Return a diagnostic for the first forbidden character in the text.

    If characters ``may_be_invisible``, they are only forbidden where :func:`check_value` finds
    them: not in comments.
    """
    forbidden = _FORBIDDEN_UNLESS_INVISIBLE if may_be_invisible else _FORBIDDEN_IN_TEXT
    if forbidden.search(source.text) is None:
        return []
    for number, line in enumerate(source.lines, start=1):
        match = forbidden.search(line)
        if match is not None:
            count = len(forbidden.findall(source.text))
            more = f", the first of {count} such characters" if count > 1 else ""
            message = f"{_character(match[0])} is not allowed in a file{more}"
            span = Span(source, number, match.start() + 1)
            return [Diagnostic(FORBIDDEN_CHARACTER, message, span, hint="delete it")]
    raise AssertionError("a character of the text is in none of its lines")


def check_value(value: str, span: Span) -> tuple[str, list[Diagnostic]]:
    """Return ``value`` without forbidden characters, and a diagnostic if there are any."""
    match = UNSAFE_IN_LINES.search(value)
    if match is None:
        return value, []
    message = f"this text contains {_character(match[0])}, which is not allowed"
    diagnostic = Diagnostic(
        FORBIDDEN_CHARACTER,
        message,
        span,
        hint="delete it"
        if match[0] in span.text
        else "remove the escape; \\t and \\n are the only allowed control characters",
    )
    return UNSAFE_IN_LINES.sub("", value), [diagnostic]


def _character(character: str) -> str:
    name = unicodedata.name(character, "")
    kind = f" ({name})" if name else ""
    return f"the character U+{ord(character):04X}{kind}"
