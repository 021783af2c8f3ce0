"""The attributes that a behavior may have, and whether other code may set more of them."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator

from composer.behavior_source import BehaviorSource, Function
from composer.behavior_source.traversal import walk
from composer.behavior_types.api import BEHAVIOR_ATTRIBUTES
from composer.behavior_types.bindings import nodes_of

_OF_OBJECTS = frozenset(dir(type("Plain", (), {})))


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
    for node in walk([statement]):
        match node:
            case ast.Name(id=name) if not is_function:
                yield name
            case ast.ClassDef(name=name):
                yield name
            case ast.alias(name=name, asname=other) if not is_function:
                yield other or name.partition(".")[0]
            case ast.Constant(value=str() as name) if name.isidentifier():
                yield name


def _escapes_from(function: Function) -> bool:
    positional = (*function.args.posonlyargs, *function.args.args)
    if not positional:
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
