"""Plain scalars by the YAML 1.2 core schema: ``NO`` is text, ``0o17`` octal, ``1e3`` a number.

Source: YAML 1.2.2, chapter 10.3.2. And the characters that no text may have.
"""

from __future__ import annotations

import math
import re
import unicodedata
from typing import Any

from composer.base.characters import INVISIBLE, UNSAFE, UNSAFE_IN_LINES
from composer.base.diagnostics import Diagnostic
from composer.base.source import SourceFile, Span
from composer.language.rules import FORBIDDEN_CHARACTER, MAX_INTEGER, MAX_NUMBER_LENGTH, MIN_INTEGER
from composer.language.tree import ScalarValue

_FORBIDDEN_IN_TEXT = re.compile(f"[{UNSAFE}]")
_FORBIDDEN_UNLESS_INVISIBLE = re.compile(f"(?![{INVISIBLE}])[{UNSAFE}]")
_WORDS: dict[str, ScalarValue] = {
    "": None,
    "~": None,
    **dict.fromkeys(("null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INTEGER = re.compile(r"[-+]?[0-9]+")
_OCTAL = re.compile(r"0o[0-7]+")
_HEXADECIMAL = re.compile(r"0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_FIRST_OF_NUMBER = frozenset("0123456789+-.")


def check_text(source: SourceFile, may_be_invisible: bool) -> list[Diagnostic]:
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


class NumberRefused(Exception):
    """A number that is not finite or exceeds the range of ROS types. The text says why."""


def resolve_plain(text: str) -> ScalarValue:
    """Return the value of an unquoted scalar. Raises NumberRefused."""
    if text in _WORDS:
        return _WORDS[text]
    if text[0] not in _FIRST_OF_NUMBER:
        return text
    if _NOT_FINITE.fullmatch(text):
        raise NumberRefused("is not a finite number")
    if _INTEGER.fullmatch(text):
        return _integer(text, 10)
    if _OCTAL.fullmatch(text):
        return _integer(text[2:], 8)
    if _HEXADECIMAL.fullmatch(text):
        return _integer(text[2:], 16)
    return _float(text) if _FLOAT.fullmatch(text) else text


def resolve_any_number(text: str) -> ScalarValue:
    """Return the same as :func:`resolve_plain`; numbers need not be finite, as in messages."""
    if _NOT_FINITE.fullmatch(text):
        return float(text.replace(".", ""))
    return resolve_plain(text)


def text_of_not_finite(value: float) -> str:
    """Return NaN or an infinity as YAML writes it."""
    return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"


def with_json_numbers(value: Any) -> Any:
    """Return plain data with text for the numbers that JSON lacks."""
    match value:
        case float() if not math.isfinite(value):
            return text_of_not_finite(value)
        case dict():
            return {key: with_json_numbers(item) for key, item in value.items()}
        case list() | tuple():
            return [with_json_numbers(item) for item in value]
        case _:
            return value


def _integer(digits: str, base: int) -> int:
    # The length first: int() takes quadratic time, and refuses more than 4300 digits.
    if len(digits) > MAX_NUMBER_LENGTH:
        raise NumberRefused(f"has more than {MAX_NUMBER_LENGTH} digits")
    value = int(digits, base)
    if not MIN_INTEGER <= value <= MAX_INTEGER:
        raise NumberRefused("does not fit into 64 bits")
    return value


def _float(text: str) -> float:
    if len(text) > MAX_NUMBER_LENGTH:
        raise NumberRefused(f"has more than {MAX_NUMBER_LENGTH} digits")
    value = float(text)
    if not math.isfinite(value):
        raise NumberRefused("is larger than a double can hold")
    return value
