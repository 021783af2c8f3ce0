"""Places in Python files, in characters: Python itself counts columns in UTF-8 bytes."""

from __future__ import annotations

import ast

from composer.source import SourceFile, Span

#: Columns are not counted exactly in a line that nobody can read: it costs its square.
_LONGEST_LINE = 10_000


def place_of(node: ast.stmt | ast.expr, source: SourceFile) -> Span:
    """Return the place of a node; of what goes on in other lines, its first character."""
    line = source.line(node.lineno)
    start = _characters(line, node.col_offset)
    if node.end_lineno != node.lineno or node.end_col_offset is None:
        return Span(source, node.lineno, start + 1)
    length = _characters(line, node.end_col_offset) - start
    return Span(source, node.lineno, start + 1, max(length, 1))


def start_of(node: ast.stmt | ast.expr, length: int, source: SourceFile) -> Span:
    """Return the place of the first ``length`` characters of a node."""
    start = _characters(source.line(node.lineno), node.col_offset)
    return Span(source, node.lineno, start + 1, length)


def _characters(line: str, size_bytes: int) -> int:
    if line.isascii() or len(line) > _LONGEST_LINE:
        return size_bytes
    return len(line.encode()[:size_bytes].decode(errors="replace"))
