"""Parses Python and compiles it, so that every error of the compiler is found; nothing is run."""

from __future__ import annotations

import ast
import warnings

from composer.python_code.source.spans import characters
from composer.python_code.source.traversal import children, walk
from composer.source import SourceFile, Span

#: Maximum number of syntax nodes that the compiler generates code for.
MAXIMUM_COMPILED_NODES = 400_000

_EXITS = (ast.Return, ast.Break, ast.Continue)


class NotPython(Exception):
    """A text is not Python; ``span`` is the location of the error, if it is known."""

    def __init__(self, message: str, span: Span | None = None) -> None:
        super().__init__(message)
        self.span = span


def parse(source: SourceFile) -> ast.Module:
    """Return the syntax tree of a file. Raises NotPython for what Python refuses to compile."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            tree = ast.parse(source.text)
        except SyntaxError as error:
            raise NotPython(error.msg, _span(error, source)) from None
        except (ValueError, RecursionError, MemoryError):
            raise NotPython("it cannot be parsed") from None
        try:
            # 'return' outside a function, for example, is refused here and not by the parser.
            if _is_small(source.text) or _compiled_nodes(tree) <= MAXIMUM_COMPILED_NODES:
                compile(tree, "<behavior>", "exec", dont_inherit=True)
        except SyntaxError as error:
            raise NotPython(error.msg, _span_in_bytes(error, source)) from None
        except (ValueError, RecursionError, MemoryError):
            raise NotPython("it cannot be compiled") from None
    return tree


def _is_small(text: str) -> bool:
    """Return whether the code is small for sure; a character makes at most two nodes."""
    return "finally" not in text and 2 * len(text) <= MAXIMUM_COMPILED_NODES


def _compiled_nodes(tree: ast.Module) -> int:
    """Return for how many nodes the compiler generates code, or a number above the maximum.

    It copies each ``finally`` block to every way out of its ``try``, so that nested blocks, which a
    short text can contain, may grow to gigabytes of code.
    """
    total = 0
    pending: list[tuple[ast.AST, int]] = [(tree, 1)]
    while pending and total <= MAXIMUM_COMPILED_NODES:
        node, copies = pending.pop()
        total += copies
        if isinstance(node, ast.Try | ast.TryStar) and node.finalbody:
            guarded = [*node.body, *node.handlers, *node.orelse]
            exits = sum(isinstance(inner, _EXITS) for inner in walk(guarded))
            pending.extend((item, copies) for item in guarded)
            pending.extend((item, copies * (2 + exits)) for item in node.finalbody)
        else:
            pending += [(child, copies) for child in children(node)]
    return total


def _span(error: SyntaxError, source: SourceFile) -> Span | None:
    """Return the location of an error of the parser; its columns are characters."""
    if error.lineno is None:
        return None
    line = min(max(error.lineno, 1), max(len(source.lines), 1))
    column = min(max(error.offset or 1, 1), len(source.line(line)) + 1)
    end = error.end_offset if error.end_lineno == error.lineno else None
    length = (end or 0) - column
    return Span(source, line, column, min(max(length, 1), len(source.line(line)) - column + 2))


def _span_in_bytes(error: SyntaxError, source: SourceFile) -> Span | None:
    """Return the location of an error of the compiler; its columns are bytes."""
    span = _span(error, source)
    if span is None:
        return None
    text = source.line(span.line)
    start = characters(text, max((error.offset or 1) - 1, 0))
    end = error.end_offset if error.end_lineno == error.lineno else None
    length = characters(text, end - 1) - start if end else 1
    return Span(source, span.line, start + 1, max(length, 1))
