"""The table ``[tool.composer]`` of a pyproject.toml, as a located tree."""

from __future__ import annotations

import re
from dataclasses import field
from typing import Any

from composer.diagnostics import Diagnostic, shown
from composer.document.limits import MAX_DEPTH, MAX_INTEGER, MIN_INTEGER
from composer.document.rules import BAD_NUMBER, NESTED_TOO_DEEP
from composer.fast_dataclass import dataclass
from composer.project.rules import BAD_SETTING
from composer.project.toml_places import NestedTooDeep, Path, Places, find_places
from composer.source import SourceFile, Span
from composer.tree import Entry, Mapping, Scalar, Sequence, Tree

TABLE = "[tool.composer]"

_PATH: Path = ("tool", "composer")
_HEADER = re.compile(r"^[ \t]*\[[ \t]*tool[ \t]*\.[ \t]*composer[ \t]*[\].]", re.MULTILINE)
_LINE_AND_COLUMN = re.compile(r"\(at line (\d+), column (\d+)\)$")
_LONG_NUMBER = re.compile(r"[0-9](?:_?[0-9]){4299,}")


def read_table(source: SourceFile) -> tuple[Mapping | None, list[Diagnostic]] | None:
    """Return the table and the errors of its TOML, or None if there is no such table."""
    if "composer" not in source.text:
        return None
    import tomllib  # noqa: PLC0415 - most projects have no such table

    try:
        places = find_places(source, _PATH)
        content = tomllib.loads(source.text)
    except tomllib.TOMLDecodeError as error:
        # Errors in a file that only mentions the composer are for the tools that read it.
        return (None, [_syntax(source, str(error))]) if _HEADER.search(source.text) else None
    except ValueError:  # int() refuses thousands of digits
        return None, [_long_number(source)]
    except (NestedTooDeep, RecursionError) as problem:
        span = problem.span if isinstance(problem, NestedTooDeep) else Span(source, 1, 1)
        message = f"tables and arrays are nested more than {MAX_DEPTH} levels deep"
        return None, [Diagnostic(NESTED_TOO_DEEP, message, span)]
    tool = content.get("tool")
    if not isinstance(tool, dict) or "composer" not in tool:
        return None
    return _Builder(places).table(tool["composer"])


def _syntax(source: SourceFile, message: str) -> Diagnostic:
    place = _LINE_AND_COLUMN.search(message)
    span = Span(source, int(place[1]), int(place[2])) if place else Span(source, 1, 1)
    reason = shown(_LINE_AND_COLUMN.sub("", message).strip())
    return Diagnostic(BAD_SETTING, f"this is not TOML: {reason}", span)


def _long_number(source: SourceFile) -> Diagnostic:
    number = _LONG_NUMBER.search(source.text)
    line = source.text.count("\n", 0, number.start()) + 1 if number is not None else 1
    return Diagnostic(BAD_NUMBER, "this number does not fit into 64 bits", Span(source, line, 1))


@dataclass(slots=True)
class _Builder:
    """Builds the tree of the table, and reports what TOML allows and the settings do not."""

    places: Places
    diagnostics: list[Diagnostic] = field(default_factory=list)

    def table(self, table: Any) -> tuple[Mapping | None, list[Diagnostic]]:
        """Return the tree of the table and the diagnostics."""
        start = self.places.key(_PATH) or Span(self.places.source, 1, 1)
        if not isinstance(table, dict):
            message = "'tool.composer' must be a table"
            hint = f"write the settings below the line {TABLE}"
            return None, [Diagnostic(BAD_SETTING, message, start, hint=hint)]
        return self._mapping(table, _PATH, start), self.diagnostics

    def _mapping(self, table: dict[str, Any], path: Path, span: Span) -> Mapping:
        entries = []
        for name, value in table.items():
            inner = (*path, name)
            key = Scalar(name, self.places.key(inner) or span)
            entries.append(Entry(key, self._tree(value, inner, key.span)))
        return Mapping(tuple(entries), span)

    def _tree(self, value: Any, path: Path, fallback: Span) -> Tree:
        span = self.places.value(path) or fallback
        match value:
            case dict():
                return self._mapping(value, path, span)
            case list():
                items = (self._tree(item, (*path, i), span) for i, item in enumerate(value))
                return Sequence(tuple(items), span)
            case bool() | str() | float():
                return Scalar(value, span)
            case int() if MIN_INTEGER <= value <= MAX_INTEGER:
                return Scalar(value, span)
            case int():
                message = "this number does not fit into 64 bits"
                self.diagnostics.append(Diagnostic(BAD_NUMBER, message, span))
                return Scalar(1, span)
            case _:  # a date or a time
                return Scalar(str(value), span)
