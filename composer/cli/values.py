"""Message contents on the terminal: YAML for people, JSON for programs."""

from __future__ import annotations

import json
from typing import Any

#: Longer lists and texts are cut, unless asked for in full.
CUT_AT = 128


def as_yaml(value: Any) -> str:
    """Return plain data as YAML, keys in their order."""
    import yaml

    text: str = yaml.safe_dump(value, sort_keys=False, allow_unicode=True, width=120)
    return text.removesuffix("\n...\n").rstrip("\n")  # the dots end a document of one scalar


def as_json(value: Any, *, indent: int | None = None) -> str:
    """Return plain data as JSON; one line unless ``indent`` is given."""
    return json.dumps(value, ensure_ascii=False, indent=indent)


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
