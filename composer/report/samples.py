"""The examples of rules: one file, or several with a line ``# file: name`` before each."""

from __future__ import annotations

import re

_HEADER = re.compile(r"# file: (?P<name>[A-Za-z0-9_./-]+)")
_MARKER = re.compile(r"(?P<kind>system|node): *(?P<name>\w+)")


def files_of(example: str) -> dict[str, str]:
    """Return the files of an example by name, the one to validate first.

    Empty for an example that is no file of ours: a command line, say.
    """
    files: dict[str, list[str]] = {}
    current: list[str] | None = None
    for line in example.splitlines(keepends=True):
        header = _HEADER.fullmatch(line.strip())
        if header is not None:
            current = files.setdefault(header["name"], [])
        elif current is None:
            name = _name(line)
            if name is None:
                return {}
            current = files.setdefault(name, [line])
        else:
            current.append(line)
    return {name: "".join(lines) for name, lines in files.items()}


def _name(first_line: str) -> str | None:
    """Return what to call a file that begins with ``first_line``: a node type by its name."""
    marker = _MARKER.match(first_line)
    if marker is None:
        return None
    return f"{marker['name']}.yaml" if marker["kind"] == "node" else "system.yaml"
