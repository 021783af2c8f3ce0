"""Leave out what a system file cannot hold, so that 'compose validate' reads what is written."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

from composer.base.characters import escape_lines, is_safe
from composer.bridges.importing.found import FoundSystem
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
    parameters = [
        (len(str(item.value)) + len(str(item.settings)), number, item)
        for number, node in enumerate(found.nodes)
        for item in node.parameters
    ]
    if not parameters:
        kept = min(MAX_ENTRIES, len(found.nodes) - max(1, int(len(found.nodes) * _PART)))
        full = (f"node {node.full_name}: the file is full" for node in found.nodes[kept:])
        return replace(found, nodes=found.nodes[:kept], left_out=(*found.left_out, *full))
    parameters.sort(key=lambda item: -item[0])
    sizes = itertools.accumulate(characters for characters, _, _ in parameters)
    removed = parameters[: sum(total < size for total in sizes) + 1]
    nodes, left_out = list(found.nodes), list(found.left_out)
    for characters, number, item in removed:
        node = nodes[number]
        kept_parameters = tuple(other for other in node.parameters if other is not item)
        nodes[number] = replace(node, parameters=kept_parameters)
        what = f"parameter {item.name} of {node.full_name}"
        left_out.append(f"{what}: its value has about {characters:,} characters")
    return replace(found, nodes=tuple(nodes), left_out=tuple(left_out))
