"""Finds attributes of a behavior whose names are misspelled where they are set."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator

from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import BehaviorSource
from composer.behavior_source.spans import attribute_span
from composer.behavior_source.traversal import walk

#: Shorter names are alike too easily.
_SHORTEST_TYPO = 4
_PAIR = 2


def misspelled_attributes(source: BehaviorSource) -> Iterator[CodeProblem]:
    """Yield the attributes that are set once, never read, and named like one that is read.

    Only a letter that is missing, doubled or swapped with the next one counts.
    """
    if not source.complete:
        return
    nodes = [node for module in source.own_modules for node in walk(module.tree.body)]
    attributes = [node for node in nodes if isinstance(node, ast.Attribute)]
    used = {node.attr for node in attributes if isinstance(node.ctx, ast.Load)}
    used |= {
        node.value
        for node in nodes
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    for home, known in source.own_classes:
        inside = [node for node in walk(known.node.body) if isinstance(node, ast.Attribute)]
        stored = [node for node in inside if isinstance(node.ctx, ast.Store) and _is_self(node)]
        times = Counter(node.attr for node in stored)
        for node in stored:
            if times[node.attr] > 1 or node.attr in used:
                continue
            meant = next((name for name in times if _is_typo(node.attr, name)), None)
            if meant in used:
                message = f"attribute '{node.attr}' is set, but never read"
                span = attribute_span(node, home.source)
                yield CodeProblem(Kind.UNUSED, message, span, f"did you mean '{meant}'?")


def _is_self(node: ast.Attribute) -> bool:
    return isinstance(node.value, ast.Name) and node.value.id == "self"


def _is_typo(name: str, meant: str) -> bool:
    """Return whether a letter inside ``name`` is missing, too many, or swapped with the next."""
    if min(len(name), len(meant)) < _SHORTEST_TYPO or name == meant:
        return False
    if len(name) == len(meant):
        pairs = [(a, b) for a, b in zip(name, meant, strict=True) if a != b]
        swapped = len(pairs) == _PAIR and pairs[0] == pairs[1][::-1]
        return swapped and "".join(pairs[0]) in meant + name
    shorter, longer = sorted((name, meant), key=len)
    # A letter or a digit at the end, as in a plural, makes another name.
    return any(longer[:at] + longer[at + 1 :] == shorter for at in range(1, len(shorter)))
