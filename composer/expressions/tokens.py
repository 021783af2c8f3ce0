"""Check the tokens of an expression before Python parses it."""

from __future__ import annotations

import re
from collections.abc import Iterator

from composer.expressions.errors import ExpressionError
from composer.fast_dataclass import dataclass

#: Limits the recursion depth of Python's parser.
MAXIMUM_TOKENS = 256
MAXIMUM_NESTING = 32

_TOKEN = re.compile(
    r"""(?P<space>[ \t\r\n]+)
    |(?P<number>(?:\d+\.\d*|\.\d+|\d+)(?:[eE][+-]?\d+)?)
    |(?P<name>[A-Za-z_][A-Za-z0-9_]*)
    |(?P<text>'[^'\\\r\n]*'|"[^"\\\r\n]*")
    |(?P<foreign>\*\*|&&|\|\||:=|<<|>>)
    |(?P<operator>==|!=|<=|>=|//|[-+*/%<>().,\[\]])
    """,
    re.VERBOSE | re.ASCII,
)
_WORDS = ("number", "name", "text")
_HINTS = {
    "&&": "write 'and'",
    "&": "write 'and'",
    "||": "write 'or'",
    "|": "write 'or'",
    "!": "write 'not'",
    "=": "write '==' to compare",
    "**": "multiply, or use sqrt() and hypot()",
    "\\": "strings in expressions have no escapes",
    "{": "an expression inside braces has no braces of its own",
    "}": "an expression inside braces has no braces of its own",
}


@dataclass(frozen=True, slots=True)
class Token:
    """A word or an operator with its offset."""

    kind: str
    text: str
    offset: int


def check_tokens(source: str) -> None:
    """Raise ExpressionError unless ``source`` has few, flat and known tokens."""
    closing: list[str] = []
    previous: Token | None = None
    for count, token in enumerate(_tokens(source)):
        if count >= MAXIMUM_TOKENS or len(closing) > MAXIMUM_NESTING:
            raise ExpressionError("the expression is too long", 0, len(source))
        _check_apart(previous, token)
        _check_bracket(token, closing)
        previous = token


def _tokens(source: str) -> Iterator[Token]:
    offset = 0
    while offset < len(source):
        match = _TOKEN.match(source, offset)
        if match is None or match.lastgroup == "foreign":
            raise _unexpected(source, offset, match.group() if match else source[offset])
        if match.lastgroup is not None and match.lastgroup != "space":
            yield Token(match.lastgroup, match.group(), offset)
        offset = match.end()


def _unexpected(source: str, offset: int, text: str) -> ExpressionError:
    if text in "'\"":
        rest = source[offset:]
        hint = _HINTS["\\"] if "\\" in rest else f"close it with {text}"
        return ExpressionError("unterminated string", offset, len(rest), hint)
    shown = text if text.isprintable() else f"\\u{ord(text[0]):04x}"
    return ExpressionError(f"unexpected '{shown}'", offset, len(text), _HINTS.get(text))


def _check_apart(previous: Token | None, token: Token) -> None:
    """Refuse ``1if``, ``0x10``, ``f'...'`` and triple quotes, which are valid in Python."""
    if previous is None or previous.kind not in _WORDS or token.kind not in _WORDS:
        return
    if previous.offset + len(previous.text) == token.offset:
        text = previous.text + token.text
        message = f"'{previous.text}' and '{token.text}' have nothing between them"
        raise ExpressionError(message, previous.offset, len(text))


def _check_bracket(token: Token, closing: list[str]) -> None:
    if token.kind != "operator":
        return
    if token.text in "([":
        closing.append(")" if token.text == "(" else "]")
    elif token.text in ")]" and (not closing or closing.pop() != token.text):
        raise ExpressionError(f"'{token.text}' closes nothing", token.offset)
