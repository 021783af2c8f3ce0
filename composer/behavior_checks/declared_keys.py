"""Checks the keys of dicts that are written down once and never change."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import lru_cache

from composer.behavior_checks.guards import OF_KEYS, asks_for_key, handles
from composer.behavior_checks.parts import possible_values, stored_in
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function, Module, helper_named
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_source.traversal import walk
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.names import value_named
from composer.behavior_types.syntax.own_classes import fields_of_class, is_record, updated_targets
from composer.behavior_types.values import OwnModule, OwnObject, Self
from composer.diagnostics import suggestion
from composer.field_types import ANYTHING

_READING = frozenset({"copy", "get", "items", "keys", "values"})
_TAKING = frozenset({"dict", "enumerate", "iter", "len", "list", "max", "min", "set", "sorted"})


def key_problems_of(
    node: ast.Subscript, function: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield the constant keys that such a dict does not have."""
    if isinstance(node.ctx, ast.Del):
        return
    declared = _of_record(node, scope) or _declared(node, scope)
    if declared is None or expects_missing(function, node.value):
        return
    if not declared:
        message = f"'{ast.unparse(node.value)}' has no keys: nothing is stored in it"
        span, about = span_of(node.slice, scope.home.source), dotted(node.value)
        yield CodeProblem(Kind.VALUE, message, span, about=about)
        return
    from composer.behavior_checks.possible_constants import (  # noqa: PLC0415 (start-up time)
        possible_constants,
    )

    candidates = [
        item for item in possible_constants(node.slice, scope) if _constant(item) is not None
    ]
    for item in candidates:
        key = _constant(item)
        if key not in declared:
            names = [other for other in declared if isinstance(other, str)]
            hint = suggestion(key, names) if isinstance(key, str) else None
            message = f"'{ast.unparse(node.value)}' has no key {key!r}"
            # what a loop or a call gives is written elsewhere
            is_here = any(item is part for part in possible_values(node.slice, scope))
            span = span_of(item if is_here else node.slice, scope.home.source)
            yield CodeProblem(Kind.VALUE, message, span, hint)
            return
    from composer.behavior_checks.parameter_values import (  # noqa: PLC0415 (start-up time)
        parameter_values,
    )

    for value in parameter_values(node.slice, scope):
        if value not in declared:
            message = f"'{ast.unparse(node.value)}' has no key {value!r} for this parameter"
            yield CodeProblem(Kind.VALUE, message, span_of(node.slice, scope.home.source))
            return


def member_key_problems_of(
    node: ast.Subscript, function: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield the members of an enumeration that such a dict does not have."""
    constant = constant_read(node.value, scope) if isinstance(node.ctx, ast.Load) else None
    written = constant[0] if constant is not None else None
    if constant is None or not isinstance(written, ast.Dict):
        return
    if not all(isinstance(key, ast.Attribute) for key in written.keys):
        return
    from composer.behavior_checks.member_keys import (  # noqa: PLC0415 (start-up time)
        member_key_problems,
    )

    yield from member_key_problems(node, written, constant[1:], function, scope)


def _of_record(node: ast.Subscript, scope: FunctionTypes) -> frozenset[str | int] | None:
    """Return the keys of a TypedDict that is read, with those that the files store in dicts."""
    found = scope.type_of(node.value)
    if not isinstance(found, OwnObject) or not isinstance(node.ctx, ast.Load):
        return None
    if not is_record(found.of):
        return None
    family = lineage(found.of)
    fields = (field.name for own in family.classes for field in fields_of_class(own))
    return frozenset(fields).union(*map(_all_stored, scope.owner.source.own_modules))


@lru_cache(maxsize=128)
def _all_stored(module: Module) -> frozenset[str]:
    """Return the constant keys that a file stores in anything."""
    return frozenset(
        node.slice.value
        for node in walk(module.tree.body)
        if isinstance(node, ast.Subscript)
        and isinstance(node.ctx, ast.Store)
        and isinstance(node.slice, ast.Constant)
        and isinstance(node.slice.value, str)
    )


def _constant(node: ast.expr) -> str | int | None:
    value = node.value if isinstance(node, ast.Constant) else None
    return value if isinstance(value, str | int) and not isinstance(value, bool) else None


def expects_missing(function: Function, owner: ast.expr) -> bool:
    """Return whether a function handles a missing key, or asks for it."""
    return handles(function, OF_KEYS) or asks_for_key(function, owner)


def _declared(node: ast.Subscript, scope: FunctionTypes) -> frozenset[str | int] | None:
    """Return the keys of the dict that is read, None if they are not known."""
    owner = node.value
    modules = scope.owner.source.own_modules
    object_ = scope.type_of(owner.value) if isinstance(owner, ast.Attribute) else ANYTHING
    if isinstance(owner, ast.Attribute) and isinstance(object_, Self | OwnObject):
        is_read = isinstance(node.ctx, ast.Load)
        places = stored_in(object_, owner.attr, scope)
        if len(places) != 1 or (not is_read and not _is_updated(node, modules)):
            return None
        return _keys_of(places[0].stored, owner.attr, modules)
    constant = constant_read(owner, scope) if isinstance(node.ctx, ast.Load) else None
    return _keys_of(constant[0], constant[1], modules) if constant is not None else None


def constant_read(node: ast.expr, scope: FunctionTypes) -> tuple[ast.expr, str, Module] | None:
    """Return what a constant of a file is assigned that is read, its name, and its file."""
    name, found = "", None
    if isinstance(node, ast.Name) and not scope.is_local(node.id):
        name, found = node.id, helper_named(node.id, scope.home)
    elif isinstance(node, ast.Attribute):
        module = scope.type_of(node.value)
        if isinstance(module, OwnModule):
            name, found = node.attr, helper_named(node.attr, module.module)
    if found is None or not found.name or name != found.name:
        return None
    written = value_named(found.name, found.module)
    return (written, name, found.module) if written is not None else None


def _is_updated(node: ast.Subscript, modules: Sequence[Module]) -> bool:
    """Return whether a subscript is the target of '+=' or the like, which reads it first."""
    return any(id(node) in updated_targets(module) for module in modules)


def _keys_of(
    written: ast.expr | None, name: str, modules: Sequence[Module]
) -> frozenset[str | int] | None:
    """Return the keys of a dict that is written down and whose name is only read."""
    found: list[str | int | None] = []
    match written:
        case ast.Dict(keys=keys):
            found = [None if key is None else _constant(key) for key in keys]
        case ast.Call(func=ast.Name(id="dict"), args=[], keywords=keywords):
            found = [item.arg for item in keywords]
        case _:
            return None
    known = frozenset(item for item in found if item is not None)
    if len(known) != len(found):
        return None
    for module in modules:
        stored = stored_keys(module, name)
        if stored is None:
            return None
        known |= stored
    return known


@lru_cache(maxsize=256)
def stored_keys(module: Module, name: str) -> frozenset[str | int] | None:
    """Return the constant keys that a file stores in what it calls ``name``.

    None: it may change it otherwise, by a method, or by passing it on.
    """
    stored: set[str | int] = set()
    safe: set[int] = set()
    for node in walk(module.tree.body):
        match node:
            case ast.AugAssign(target=ast.Subscript(value=owner)):
                safe.add(id(node.target))
                safe.add(id(owner))
            case ast.Subscript(value=owner, slice=index, ctx=context):
                key = _constant(index)
                if isinstance(context, ast.Load) or id(node) in safe:
                    safe.add(id(owner))
                elif isinstance(context, ast.Store) and key is not None:
                    safe.add(id(owner))
                    if _named(owner) == name:
                        stored.add(key)
            case ast.Attribute(value=owner, attr=attr) if attr in _READING:
                safe.add(id(owner))
            case ast.Compare(comparators=others):
                safe.update(map(id, others))
            case ast.For(iter=iterated) | ast.comprehension(iter=iterated):
                safe.add(id(iterated))
            case ast.Call(func=ast.Name(id=called), args=arguments) if called in _TAKING:
                safe.update(map(id, arguments))
            case ast.Assign(targets=[_, _, *_]):
                pass  # what has two names may change by either
            case ast.Assign(targets=targets):
                safe.update(id(item) for item in targets if not isinstance(item, ast.Subscript))
            case ast.AnnAssign(target=target):
                safe.add(id(target))
    uses = (node for node in walk(module.tree.body) if _named(node) == name)
    return frozenset(stored) if all(id(node) in safe for node in uses) else None


def _named(node: ast.AST) -> str:
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
        case _:
            return ""
