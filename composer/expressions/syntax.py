"""Parse text to Python's syntax tree, within limits."""

from __future__ import annotations

import ast

from composer.expressions.errors import ExpressionError
from composer.expressions.tokens import check_tokens

MAXIMUM_LENGTH = 500
MAXIMUM_NODES = 64


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
    data = text.encode()
    for node in ast.walk(tree):
        if isinstance(node, ast.expr):
            end = node.end_col_offset if node.end_col_offset is not None else node.col_offset
            node.end_col_offset = skipped + len(data[:end].decode(errors="ignore"))
            node.col_offset = skipped + len(data[: node.col_offset].decode(errors="ignore"))
