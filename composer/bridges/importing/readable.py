"""Leave out what a system file cannot hold, so that 'compose validate' reads what is written."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from composer.base.characters import escape_lines, is_safe
from composer.bridges.importing.found import FoundNode, FoundParameter, FoundSystem
from composer.bridges.importing.writing import write_system
from composer.language.document import parse_bytes
from composer.language.document.limits import MAX_ENTRIES
from composer.language.rules import TOO_LARGE
from composer.language.tree import Plain

#: The part of a file that is left out at once, if it is too large.
_PART = 0.1


def readable(found: FoundSystem) -> FoundSystem:
    """Return what a file can hold: without the largest parameters, and then the last nodes."""
    found = _without_unreadable(found)
    while True:
        content = write_system(found).encode()
        _, _, diagnostics = parse_bytes(content, found.name)
        is_large = any(item.rule is TOO_LARGE for item in diagnostics)
        if not is_large and len(found.nodes) <= MAX_ENTRIES:
            return found
        found = _smaller(found, int(len(content) * _PART))


def _without_unreadable(found: FoundSystem) -> FoundSystem:
    """Leave out values that the language does not have: control characters, and no numbers."""
    left_out = list(found.left_out)
    nodes = []
    for node in found.nodes:
        kept = []
        for item in node.parameters:
            if _is_readable(item.value):
                settings = {key: _escaped(value) for key, value in item.settings.items()}
                kept.append(replace(item, settings=settings))
            else:
                problem = "its value has characters or numbers that a file cannot have"
                left_out.append(f"parameter {item.name} of {node.full_name}: {problem}")
        nodes.append(replace(node, parameters=tuple(kept)))
    return replace(found, nodes=tuple(nodes), left_out=tuple(left_out))


def _is_readable(value: Plain) -> bool:
    match value:
        case str():
            return is_safe(value)
        case float():
            return math.isfinite(value)
        case list():
            return all(map(_is_readable, value))
    return True


def _escaped(value: Plain) -> Plain:
    return escape_lines(value) if isinstance(value, str) else value


def _smaller(found: FoundSystem, size: int) -> FoundSystem:
    """Leave out the largest parameters, at least ``size`` characters; without any, nodes."""
    parameters = sorted(_parameters(found), key=lambda item: item[0], reverse=True)
    removed: dict[tuple[str, str], int] = {}
    for characters, node, item in parameters:
        if sum(removed.values()) >= size:
            break
        removed[node.full_name, item.name] = characters
    if removed:
        nodes = tuple(
            replace(
                node,
                parameters=tuple(
                    item for item in node.parameters if (node.full_name, item.name) not in removed
                ),
            )
            for node in found.nodes
        )
        left_out = [
            f"parameter {name} of {node}: its value has about {characters:,} characters"
            for (node, name), characters in removed.items()
        ]
    else:
        count = max(1, int(len(found.nodes) * _PART), len(found.nodes) - MAX_ENTRIES)
        nodes = found.nodes[:-count]
        left_out = [f"node {node.full_name}: the file is full" for node in found.nodes[-count:]]
    return replace(found, nodes=nodes, left_out=(*found.left_out, *left_out))


def _parameters(found: FoundSystem) -> Iterator[tuple[int, FoundNode, FoundParameter]]:
    """Yield each parameter with its size in characters."""
    for node in found.nodes:
        for item in node.parameters:
            yield len(str(item.value)) + len(str(item.settings)), node, item
