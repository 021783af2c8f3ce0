"""Message contents on the terminal: YAML for people, JSON and CSV for programs."""

from __future__ import annotations

import json
from typing import Any

#: Longer lists and texts are cut, unless asked for in full.
CUT_AT = 128


def as_yaml(value: Any, *, one_line: bool = False) -> str:
    """Return plain data as YAML, keys in their order."""
    import yaml

    text: str = yaml.safe_dump(
        value,
        sort_keys=False,
        allow_unicode=True,
        width=float("inf") if one_line else 120,
        default_flow_style=one_line,
    )
    return text.removesuffix("\n...\n").rstrip("\n")  # the dots end a document of one scalar


def as_json(value: Any, *, indent: int | None = None) -> str:
    """Return plain data as JSON; one line unless ``indent`` is given."""
    return json.dumps(value, ensure_ascii=False, indent=indent)


def as_csv(value: Any) -> str:
    """Return every scalar of plain data, in order, as one line of CSV (RFC 4180)."""
    import csv
    import io

    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(_scalars(value))
    return line.getvalue()


def without(kind: type[str | list[Any]], value: Any) -> Any:
    """Return plain data with its texts, or its lists, replaced by how long they are."""
    if isinstance(value, kind):
        return f"<{len(value)} {'characters' if kind is str else 'items'}>"
    if isinstance(value, dict):
        return {name: without(kind, item) for name, item in value.items()}
    if isinstance(value, list):
        return [without(kind, item) for item in value]
    return value


def _scalars(value: Any) -> list[Any]:
    match value:
        case dict():
            return [scalar for item in value.values() for scalar in _scalars(item)]
        case list():
            return [scalar for item in value for scalar in _scalars(item)]
        case _:
            return [value]


def cut(value: Any, longest: int = CUT_AT) -> Any:
    """Return plain data with long lists and texts cut to ``longest`` items."""
    if isinstance(value, dict):
        return {name: cut(item, longest) for name, item in value.items()}
    if isinstance(value, list):
        shown = [cut(item, longest) for item in value[:longest]]
        return shown if len(value) <= longest else [*shown, f"... {len(value)} items"]
    if isinstance(value, str) and len(value) > longest:
        return f"{value[:longest]}..."
    return value
