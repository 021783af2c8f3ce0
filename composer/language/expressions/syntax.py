"""Parse text to Python's syntax tree, within limits, once its tokens are checked."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from composer.base.fast_dataclass import dataclass
from composer.language.expressions.expression import ExpressionError

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
MAXIMUM_LENGTH = 500
MAXIMUM_NODES = 64


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


def parse(source: str) -> ast.expr:
    """Return the syntax tree of ``source``, with columns in characters.

    Raises ExpressionError if it is too long, too deep or invalid.
    """
    _check_length(source)
    check_tokens(source)
    flat = "".join(" " if character in "\t\r\n" else character for character in source)
    text = flat.lstrip(" ")
    skipped = len(flat) - len(text)
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise _syntax_error(source, error, skipped) from None
    except (ValueError, RecursionError, MemoryError):  # lone surrogates, or little stack left
        raise ExpressionError("the expression cannot be read", 0, len(source)) from None
    _count_nodes(source, tree)
    _count_characters(text, tree, skipped)
    return tree


def extent(node: ast.expr) -> tuple[int, int]:
    """Return the offset and the length of ``node`` in characters of the source."""
    end = node.end_col_offset if node.end_col_offset is not None else node.col_offset + 1
    return node.col_offset, end - node.col_offset


def _check_length(source: str) -> None:
    if not source.strip():
        raise ExpressionError("the expression is empty", 0, len(source))
    if len(source) > MAXIMUM_LENGTH:
        message = f"the expression has {len(source)} characters, more than {MAXIMUM_LENGTH}"
        raise ExpressionError(message, 0, MAXIMUM_LENGTH)


def _syntax_error(source: str, error: SyntaxError, skipped: int) -> ExpressionError:
    end = len(source.rstrip())
    if source[:end].endswith(("+", "-", "*", "/", "%", "<", ">", "=", ",", ".", "(", "[")):
        return ExpressionError("something is missing at the end", end - 1)
    offset = min(skipped + max((error.offset or 1) - 1, 0), end - 1)
    length = (error.end_offset or 0) - (error.offset or 0)
    message = error.msg.partition(". ")[0]  # the rest is about Python, not this language
    return ExpressionError(message, offset, max(min(length, end - offset), 1))


def _count_nodes(source: str, tree: ast.expr) -> None:
    count = sum(isinstance(node, ast.expr) for node in ast.walk(tree))
    if count > MAXIMUM_NODES:
        message = f"the expression has {count} parts, more than {MAXIMUM_NODES}"
        raise ExpressionError(message, 0, len(source))


def _count_characters(text: str, tree: ast.expr, skipped: int) -> None:
    """Convert Python's columns, in UTF-8 bytes of ``text``, to columns of the source."""
    if not skipped and text.isascii():
        return
    data = text.encode()
    for node in ast.walk(tree):
        if isinstance(node, ast.expr):
            end = node.end_col_offset if node.end_col_offset is not None else node.col_offset
            node.end_col_offset = skipped + len(data[:end].decode(errors="ignore"))
            node.col_offset = skipped + len(data[: node.col_offset].decode(errors="ignore"))
