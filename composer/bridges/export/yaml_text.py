"""YAML that parsers of YAML 1.1 and 1.2 read alike, with comments."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import yaml

#: Begins like a name or a path, so that no parser takes it for a number, and has no syntax in it.
_PLAIN = re.compile(r"[A-Za-z_/.][A-Za-z0-9_/.+=@-]*\Z")
_NOT_TEXT = {"y", "n", "yes", "no", "on", "off", "true", "false", "null", ".inf", ".nan", "~"}
#: A key that stands for a comment; its value is the text.
_COMMENT = re.compile(r'^( *)"?#\d+"?: (.*)$', re.MULTILINE)


class _Dumper(yaml.SafeDumper):
    """Quotes every text that some parser may take for something else, and indents lists."""

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        del indentless  # always of lists in mappings
        super().increase_indent(flow, indentless=False)

    def ignore_aliases(self, data: Any) -> bool:
        del data  # none is written as an alias of another
        return True


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    is_plain = _PLAIN.match(text) and text.lower() not in _NOT_TEXT and not _is_number(text)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if is_plain else '"')


def _is_number(text: str) -> bool:
    return text.startswith(".") and text[1:2].isdigit()


_Dumper.add_representer(str, _text)


def yaml_text(document: Mapping[str, Any]) -> str:
    """Return a document in the order of its keys.

    Keys such as ``#1`` stand for comments, whose values are their texts.
    """
    width: Any = math.inf  # a line that begins within a text could look like a comment
    text = yaml.dump(document, Dumper=_Dumper, sort_keys=False, width=width, allow_unicode=True)
    return _COMMENT.sub(_comment, text)


def _comment(match: re.Match[str]) -> str:
    indent, value = match.groups()
    return "\n".join(f"{indent}# {line}" for line in str(yaml.safe_load(value)).splitlines())


def without_variables(value: Any) -> Any:
    """Return a value in which docker compose and Kubernetes replace no variables."""
    match value:
        case str():
            return value.replace("$", "$$")
        case dict():
            return {key: without_variables(item) for key, item in value.items()}
        case list():
            return [without_variables(item) for item in value]
        case _:
            return value
