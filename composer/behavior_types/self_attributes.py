"""The attributes that a behavior may have, and whether other code may set more of them."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable, Iterator

from composer.behavior_source import BehaviorSource, Function
from composer.behavior_source.spans import attribute_span
from composer.behavior_source.traversal import walk
from composer.behavior_types.api import BEHAVIOR_ATTRIBUTES
from composer.behavior_types.bindings import is_static, nodes_of
from composer.behavior_types.problems import CodeProblem, Kind

_OF_OBJECTS = frozenset({*dir(type("Plain", (), {})), *dir(type)})


def self_attributes(source: BehaviorSource, assigned: Iterable[str]) -> frozenset[str]:
    """Return the attributes of a behavior whose class is known completely.

    ``assigned`` are those that its methods assign. A name in a string counts, because
    ``setattr(self, "name", ...)`` may set it.
    """
    found = {*_OF_OBJECTS, *BEHAVIOR_ATTRIBUTES, *assigned}
    for _, known in source.classes:
        found.update(method.name for method in known.methods)
        for statement in known.node.body:
            found.update(defined_names(statement))
    return frozenset(found)


def escapes(source: BehaviorSource) -> bool:
    """Return whether a behavior passes itself on, so that other code may set its attributes."""
    return any(
        method.node is not None and _escapes_from(method.node)
        for _, known in source.classes
        for method in known.methods
    )


def defined_names(statement: ast.stmt, *, declared: bool = False) -> Iterator[str]:
    """Yield the names that a statement of a class may define.

    ``name: type`` alone defines nothing, except in a dataclass: if ``declared`` is true.
    """
    if isinstance(statement, ast.AnnAssign) and statement.value is None and not declared:
        return
    is_function = isinstance(statement, Function)
    by_name = not is_function or _sets_by_name(statement)
    for node in walk([statement]):
        match node:
            case ast.Name(id=name) if not is_function:
                yield name
            case ast.ClassDef(name=name):
                yield name
            case ast.alias(name=name, asname=other) if not is_function:
                yield other or name.partition(".")[0]
            case ast.Constant(value=str() as name) if name.isidentifier() and by_name:
                yield name


def _sets_by_name(statement: ast.stmt) -> bool:
    """Return whether a function calls ``setattr`` or ``vars``, or passes names on to what may."""
    return any(
        (isinstance(node, ast.Name) and node.id in {"setattr", "vars"})
        or (isinstance(node, ast.Attribute) and node.attr in {"__dict__", "__setattr__"})
        for node in walk([statement])
    )


def _escapes_from(function: Function) -> bool:
    positional = (*function.args.posonlyargs, *function.args.args)
    if not positional or is_static(function):
        return False
    receiver = positional[0].arg
    uses = 0
    for node in nodes_of(function):
        match node:
            case ast.Name(id=name) if name == receiver:
                uses += 1
            case ast.Attribute(value=ast.Name(id=name), attr=attribute) if name == receiver:
                if attribute == "__dict__":
                    return True
                uses -= 1
    return uses > 0


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


#: Shorter names are alike too easily.
_SHORTEST_TYPO = 5
_PAIR = 2
