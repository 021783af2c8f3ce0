"""Checks dicts that are written down with members of an enumeration as keys."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from composer.behavior_checks.declared_keys import expects_missing, stored_keys
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function, Module
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_source.traversal import children, walk
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.syntax.own_classes import is_enumeration
from composer.behavior_types.values import OwnClass, OwnObject


def member_key_problems(
    node: ast.Subscript,
    written: ast.Dict,
    constant: tuple[str, Module],
    function: Function,
    scope: FunctionTypes,
) -> Iterator[CodeProblem]:
    """Yield a member that a dict does not have, and that the subscript reads.

    If it may be any member, one is missing that the files use, and never distinguish. ``constant``
    is the name of the dict, and its file.
    """
    name, home = constant
    found = _keys(written.keys, scope.owner.at_module(home))
    modules = scope.owner.source.own_modules
    if found is None or any(stored_keys(module, name) != frozenset() for module in modules):
        return
    own, keys = found
    if expects_missing(function, node.value) or any(_is_asked(item, name) for item in modules):
        return
    members, index = _members(own), node.slice
    is_one = isinstance(index, ast.Attribute) and scope.type_of(index.value) == own
    if isinstance(index, ast.Attribute) and is_one:
        missing = frozenset({index.attr}) & members - keys
    elif scope.type_of(index) == OwnObject(own) and len(members - keys) <= len(keys):
        missing = members - keys
    else:
        return
    for member in sorted(missing):
        if is_one or _is_usual(member, own, modules, function, index):
            problem = f"'{ast.unparse(node.value)}' has no key {own.definition.name}.{member}"
            yield CodeProblem(Kind.VALUE, problem, span_of(index, scope.home.source))
            return


def _keys(
    written: Sequence[ast.expr | None], scope: FunctionTypes
) -> tuple[OwnClass, frozenset[str]] | None:
    """Return the enumeration and its members that are the keys of a dict, None for others."""
    owners: set[OwnClass] = set()
    names: set[str] = set()
    for key in written:
        owner = scope.type_of(key.value) if isinstance(key, ast.Attribute) else None
        if not isinstance(owner, OwnClass) or not isinstance(key, ast.Attribute):
            return None
        owners.add(owner)
        names.add(key.attr)
    only = owners.pop() if len(owners) == 1 else None
    if only is None or not is_enumeration(only, "enum.Enum", "enum.IntEnum", "enum.StrEnum"):
        return None
    return only, frozenset(names)


def _members(own: OwnClass) -> frozenset[str]:
    """Return the members of an enumeration with values of their own, none if some are equal."""
    found: dict[str, str] = {}
    for statement in own.definition.node.body:
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)], value=value) if not name.startswith("_"):
                found[name] = ast.unparse(value)
    values = [value for value in found.values() if "auto(" not in value]
    return frozenset(found) if len(values) == len(set(values)) else frozenset()


def _is_usual(
    member: str, own: OwnClass, modules: Sequence[Module], function: Function, index: ast.expr
) -> bool:
    """Return whether the files give something a member, and nothing treats it differently."""
    written = ast.unparse(index)
    for node in nodes_of(function):
        if isinstance(node, ast.Compare | ast.Match) and written in ast.unparse(node):
            return False
    uses = [use for module in modules for use in _uses(module, own, member)]
    return True in uses and False not in uses


_STORING = (ast.AnnAssign, ast.Assign, ast.Return)
_COMPARING = (ast.Compare, ast.List, ast.Match, ast.Set, ast.Tuple)


def _uses(module: Module, own: OwnClass, member: str) -> Iterator[bool]:
    """Yield whether a member is stored or returned, False where something may distinguish it.

    Keys of dicts and what calls take are neither.
    """
    pending: list[tuple[ast.AST, bool | None]] = [(module.tree, None)]
    while pending:
        node, use = pending.pop()
        is_member = isinstance(node, ast.Attribute) and node.attr == member
        if is_member and _last(getattr(node, "value", None)) == own.definition.name:
            if use is not None:
                yield use
            continue
        keys: set[int] = set()
        match node:
            case ast.Dict():
                keys = {id(key) for key in node.keys}
            case ast.Call():
                use = None if use else use
            case _ if isinstance(node, _STORING):
                use = True if use is None else use
            case _ if isinstance(node, _COMPARING):
                use = False
        pending += [(child, use) for child in children(node) if id(child) not in keys]


def _is_asked(module: Module, name: str) -> bool:
    """Return whether a file asks for the keys of what it calls ``name``."""
    return any(
        isinstance(node, ast.Compare) and any(_last(item) == name for item in node.comparators)
        for node in walk(module.tree.body)
    )


def _last(node: ast.expr | None) -> str:
    return dotted(node).rpartition(".")[2] if node is not None else ""
