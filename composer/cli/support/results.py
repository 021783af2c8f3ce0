"""Results of commands on stdout: YAML and JSON."""

from __future__ import annotations

import json
import math
from typing import Any

from composer.base.characters import escape_json, is_safe
from composer.cli.support.terminal import say


def as_yaml(value: Any) -> str:
    """Return plain data as YAML, keys in their order."""
    import yaml

    def dump(*, allow_unicode: bool) -> str:
        text: str = yaml.safe_dump(
            value, sort_keys=False, allow_unicode=allow_unicode, width=120, default_flow_style=False
        )
        return text

    text = dump(allow_unicode=True)
    if not is_safe(text):  # PyYAML does not escape characters that change the direction of text
        text = dump(allow_unicode=False)
    return text.removesuffix("\n...\n").rstrip("\n")  # the dots end a document of one scalar


def as_json(value: Any, *, indent: int | None = None) -> str:
    """Return plain data as JSON; one line unless ``indent`` is given.

    Numbers that JSON lacks become strings, as YAML writes them: ``".nan"``, ``"-.inf"``.
    """
    try:
        text = json.dumps(value, ensure_ascii=False, indent=indent, allow_nan=False)
    except ValueError:
        text = json.dumps(_with_json_numbers(value), ensure_ascii=False, indent=indent)
    return escape_json(text)


def _with_json_numbers(value: Any) -> Any:
    from composer.language.document.scalars import text_of_not_finite

    match value:
        case float() if not math.isfinite(value):
            return text_of_not_finite(value)
        case dict():
            return {key: _with_json_numbers(item) for key, item in value.items()}
        case list() | tuple():
            return [_with_json_numbers(item) for item in value]
        case _:
            return value


def truncated(value: Any, max_length: int) -> Any:
    """Return plain data with lists and strings cut to ``max_length`` items."""
    if isinstance(value, dict):
        return {name: truncated(item, max_length) for name, item in value.items()}
    if isinstance(value, list):
        shown = [truncated(item, max_length) for item in value[:max_length]]
        return shown if len(value) <= max_length else [*shown, f"... {len(value)} items"]
    if isinstance(value, str) and len(value) > max_length:
        return f"{value[:max_length]}..."
    return value


def say_none_found(kind: str) -> None:
    """Explain an empty list on stderr."""
    say(f"no {kind} found: check that the system is running and that ROS_DOMAIN_ID is the same")
