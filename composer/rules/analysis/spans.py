"""The spans of parts of a value."""

from __future__ import annotations

from composer.base.source import Located, Span
from composer.language.expressions import Expression, FieldPath


def part_of(text: Located[str], start: int, length: int) -> Span:
    """Return the span of ``length`` characters of ``text`` from ``start``.

    If the file does not contain the text literally, because of variables or escapes, return the
    span of the whole text.
    """
    span = text.span
    part = text.value[start : start + length]
    source_text = span.file.line(span.line)[span.column - 1 : span.column - 1 + span.length]
    found = source_text.find(part, start)
    if found < 0 and start + length == len(text.value):  # a variable or an escape precedes it
        end = len(source_text.rstrip("'\""))
        found = end - length if source_text[:end].endswith(part) else -1
    return span.part(found, len(part)) if part and found >= 0 else span


def part_of_path(span: Span, expression: Expression, path: FieldPath, index: int = 0) -> Span:
    """Return the span of part ``index`` of a path within an expression at ``span``.

    If the file does not contain the expression literally, return the span of all of it.
    """
    source = expression.source
    offset = path.offset
    for part in path.parts[: index + 1]:
        found = source.find(str(part), offset, path.offset + path.length)
        if found < 0:
            return span
        start, offset = found, found + len(str(part))
    source_text = span.file.line(span.line)[span.column - 1 : span.column - 1 + span.length]
    return span.part(start, len(str(path.parts[index]))) if source_text == source else span


def class_name_hint(text: str) -> str:
    """Return the hint for ``text`` in place of ``module:Class``."""
    module, _, name = text.rstrip(":").rpartition(".")
    is_dotted = bool(module) and name[:1].isupper()
    return f"did you mean '{module}:{name}'?" if is_dotted else "write 'module:Class'"
