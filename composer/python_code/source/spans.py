"""Spans in Python files, in characters: Python counts columns in UTF-8 bytes."""

from __future__ import annotations

import ast

from composer.source import SourceFile, Span

#: Columns in longer lines are not exact, because counting takes quadratic time.
_LONGEST_LINE = 10_000


def span_of(node: ast.stmt | ast.expr, source: SourceFile) -> Span:
    """Return the span of a node; of one with several lines, its first character."""
    line = source.line(node.lineno)
    start = characters(line, node.col_offset)
    if node.end_lineno != node.lineno or node.end_col_offset is None:
        return Span(source, node.lineno, start + 1)
    length = characters(line, node.end_col_offset) - start
    return Span(source, node.lineno, start + 1, max(length, 1))


def start_span(
    node: ast.stmt | ast.expr | ast.keyword | ast.alias, length: int, source: SourceFile
) -> Span:
    """Return the span of the first ``length`` characters of a node."""
    start = characters(source.line(node.lineno), node.col_offset)
    return Span(source, node.lineno, start + 1, length)


def characters(line: str, size_bytes: int) -> int:
    """Return the number of characters in the first ``size_bytes`` bytes of a line, as UTF-8."""
    if line.isascii() or len(line) > _LONGEST_LINE:
        return size_bytes
    return len(line.encode()[:size_bytes].decode(errors="replace"))
