"""The place of a part of a value."""

from __future__ import annotations

from composer.expressions import Expression, FieldPath
from composer.source import Located, Span


def part_of(text: Located[str], start: int, length: int) -> Span:
    """Return the place of ``length`` characters of ``text`` from ``start``.

    Where the file does not say the text in so many characters (it was put together from
    variables, or escaped) the place of the whole is returned.
    """
    span = text.span
    wanted = text.value[start : start + length]
    written = span.file.line(span.line)[span.column - 1 : span.column - 1 + span.length]
    found = written.find(wanted, start)
    if found < 0 and start + length == len(text.value):  # something else was put before it
        end = len(written.rstrip("'\""))
        found = end - length if written[:end].endswith(wanted) else -1
    return span.part(found, len(wanted)) if wanted and found >= 0 else span


def part_of_path(span: Span, expression: Expression, path: FieldPath, index: int = 0) -> Span:
    """Return the place of part ``index`` of a path, within an expression that stands at ``span``.

    Where the file does not say the expression in so many characters, the place of all of it.
    """
    source = expression.source
    offset = path.offset
    for part in path.parts[: index + 1]:
        found = source.find(str(part), offset, path.offset + path.length)
        if found < 0:
            return span
        start, offset = found, found + len(str(part))
    written = span.file.line(span.line)[span.column - 1 : span.column - 1 + span.length]
    return span.part(start, len(str(path.parts[index]))) if written == source else span
