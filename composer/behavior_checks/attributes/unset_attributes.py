"""Finds attributes that a method reads, although they may not be set by then."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache

from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.flow import always_evaluated, evaluated
from composer.behavior_source.method_body import is_none
from composer.behavior_source.spans import attribute_span, span_of
from composer.behavior_source.traversal import walk
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.hosted import HostedTypes
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.syntax.own_classes import known_attributes
from composer.behavior_types.syntax.self_attributes import class_attributes, self_attributes
from composer.behavior_types.values import Self

#: The methods that run before all others.
_FIRST = ("__init__", "on_configure", "on_activate")

#: A method with the types within it.
_Methods = Mapping[str, tuple[Function, FunctionTypes]]


def unset_attributes(types: BehaviorTypes) -> Iterator[CodeProblem]:
    """Yield the attributes that a method uses before any, or perhaps before another one, sets them.

    An attribute that is None at first may be set later as well as one that is not set at all.
    """
    if not types.source.complete or types.self_escapes:
        return
    methods = _methods_of(types)
    none, values = _stored(methods)
    first = _reached(_FIRST, methods)
    later = {name: setters for name, setters in values.items() if not setters & first}
    at_first = {name: found for name, found in later.items() if none.get(name, set()) & {*_FIRST}}
    yield from _perhaps_none(types, methods, at_first)
    by_handlers = _reached(tuple(types.handlers), methods)  # others may be called from outside
    own = {name for _, scope in methods.values() for name in scope.bindings.attributes}
    own -= self_attributes(types.source, ()) | _in_texts(methods) | none.keys()
    own &= values.keys()
    missing = {
        name: setters for name, setters in later.items() if name in own and setters <= by_handlers
    }
    has_start = any(first & setters for setters in values.values())
    found = [
        *_never_set(methods, {name: values[name] for name in own & types.self_attributes}),
        *_before_goals(types, methods, missing),
        *_missing(types, methods, missing, has_start=has_start),
    ]
    names: set[str] = set()
    for name, problem in found:
        if name not in names:
            yield problem
        names.add(name)


def late_attributes(types: HostedTypes) -> Iterator[CodeProblem]:
    """Yield the attributes of a class that all methods which set them have read before."""
    if not types.source.complete or types.self_escapes:
        return
    methods = _methods_of(types)
    none, values = _stored(methods)
    own = {name for _, scope in methods.values() for name in scope.bindings.attributes}
    own -= class_attributes(types.source, ()) | _in_texts(methods) | none.keys()
    for base in types.bases:
        own -= known_attributes(base) or set()
    known = {name: values[name] for name in own & types.self_attributes & values.keys()}
    for _, problem in _never_set(methods, known):
        yield problem


def _methods_of(types: BehaviorTypes) -> _Methods:
    """Return the methods of the class, by name."""
    methods: dict[str, tuple[Function, FunctionTypes]] = {}
    for home, known in reversed(types.source.classes):
        for method in known.methods:
            scope = types.scope(method, home)
            if method.node is not None and scope is not None:
                methods[method.name] = method.node, scope
    return methods


#: An attribute with its problem.
_Found = tuple[str, CodeProblem]


def _perhaps_none(
    types: BehaviorTypes, methods: _Methods, unset: dict[str, set[str]]
) -> Iterator[CodeProblem]:
    """Yield the attributes that are None at first and are used by a handler."""
    for handler in types.handlers:
        if handler not in methods or handler.startswith("accept_") or not unset:
            continue
        function, scope = methods[handler]
        reached = _reached((handler,), methods)
        for node in always_evaluated(function):
            match node:
                case (
                    ast.Attribute(value=ast.Attribute(attr=name) as owner)
                    | ast.Subscript(value=ast.Attribute(attr=name) as owner)
                ) if name in unset:
                    setters = unset[name]
                    is_accepted = any(item.startswith("accept_") for item in setters)
                    is_own = isinstance(scope.type_of(owner.value), Self)
                    if is_own and not is_accepted and not setters & reached:
                        del unset[name]
                        setter = min(setters)
                        message = f"this may be None: '{setter}' sets it, perhaps later"
                        span = span_of(owner, scope.home.source)
                        hint = f"check it first, as in 'if self.{name} is not None'"
                        yield CodeProblem(Kind.NONE, message, span, hint)


def _missing(
    types: BehaviorTypes, methods: _Methods, unset: dict[str, set[str]], *, has_start: bool
) -> Iterator[_Found]:
    """Yield the attributes that no method has set when the first ones, or a handler, read them.

    A class whose first methods set no attributes, so that ``has_start`` is false, may rely on the
    order of its messages.
    """
    unset = dict(unset)
    starts = [name for name in _FIRST if name in methods]
    handlers = [name for name in types.handlers if not name.startswith("accept_")]
    for start in (*starts, *(name for name in handlers if name in methods)):
        if not unset:
            return
        is_first = start in _FIRST
        reached = _reached((start,), methods)
        for node, scope in _reads(start, methods):
            name = node.attr
            setters = unset.get(name)
            if setters is None or any(item.startswith("accept_") for item in setters):
                continue
            is_early = start in setters and node.lineno < _first_stores(methods[start][0])[name]
            others = setters - {start} if is_early else setters
            is_own = is_early and not others
            if others & reached or not (has_start or is_first or is_own):
                continue
            del unset[name]
            setter = min(others or setters)
            if is_first or is_own:
                yield _not_set(node, {setter}, scope)
            else:
                message = f"'{name}' may not be set yet: '{setter}' sets it, perhaps later"
                span = attribute_span(node, scope.home.source)
                yield name, CodeProblem(Kind.NONE, message, span, _hint(name))


def _not_set(node: ast.Attribute, setters: set[str], scope: FunctionTypes) -> _Found:
    named = " and ".join(f"'{setter}'" for setter in sorted(setters))
    sets = "sets" if len(setters) == 1 else "set"
    message = f"'{node.attr}' is not set yet: only {named} {sets} it, later"
    span = attribute_span(node, scope.home.source)
    return node.attr, CodeProblem(Kind.ATTRIBUTE, message, span, _hint(node.attr))


def _hint(name: str) -> str:
    return f"set self.{name} in 'on_configure'"


def _before_goals(
    types: BehaviorTypes, methods: _Methods, unset: Mapping[str, set[str]]
) -> Iterator[_Found]:
    """Yield what is read to accept a goal, and is set only when one is executed."""
    for start in types.handlers:
        executing = f"on_{start.removeprefix('accept_')}"
        if not start.startswith("accept_") or not {start, executing} <= methods.keys():
            continue
        handlers = {*types.handlers, *_FIRST} - {executing}
        others = _reached(tuple(handlers), methods)
        for node, scope in _reads(start, methods):
            setters = unset.get(node.attr, set())
            if setters and not setters & others:
                yield _not_set(node, setters, scope)


def _reads(start: str, methods: _Methods) -> Iterator[tuple[ast.Attribute, FunctionTypes]]:
    """Yield the attributes of ``self`` that each call of a method reads, also in other methods."""
    pending, seen = [start], {start}
    while pending:
        function, scope = methods[pending.pop()]
        for node in sorted(always_evaluated(function), key=_place):
            match node:
                case ast.Attribute(value=ast.Name(id=owner), ctx=ast.Load()) if (
                    owner == scope.bindings.receiver
                ):
                    yield node, scope
                case ast.Call(func=ast.Attribute(value=ast.Name(id=owner), attr=name)) if (
                    owner == scope.bindings.receiver
                ):
                    if name in methods and name not in seen:
                        seen.add(name)
                        pending.append(name)


def _place(node: ast.AST) -> tuple[int, int]:
    return getattr(node, "lineno", 0), getattr(node, "col_offset", 0)


def _never_set(methods: _Methods, values: Mapping[str, set[str]]) -> Iterator[_Found]:
    """Yield the attributes that all methods which set them have read before.

    What executes a goal comes after what accepts it.
    """
    for name, setters in values.items():
        reads = [_read_first(name, setter, methods) for setter in setters]
        known = [read for read in reads if read is not None]
        if len(known) == len(reads):
            node, scope = min(known, key=lambda read: read[0].lineno)
            yield _not_set(node, setters, scope)


def _read_first(
    name: str, setter: str, methods: _Methods
) -> tuple[ast.Attribute, FunctionTypes] | None:
    """Return where an attribute is read in any case before a method sets it, or None."""
    function, scope = methods[setter]
    receiver = scope.bindings.receiver
    read = None if receiver is None else _reads_before_stores(function, receiver).get(name)
    if read is not None:
        return read, scope
    start = f"accept_{setter.removeprefix('on_')}"
    found = _reads(start, methods) if setter.startswith("on_") and start in methods else ()
    return next((item for item in found if item[0].attr == name), None)


@lru_cache(maxsize=512)
def _reads_before_stores(function: Function, receiver: str) -> Mapping[str, ast.Attribute]:
    """Return where a method reads attributes in any case before it sets them, by their names."""
    found: dict[str, ast.Attribute] = {}
    stored: set[str] = set()
    for statement in function.body:
        for node in sorted(_before_body(statement), key=_place):
            match node:
                case ast.Attribute(value=ast.Name(id=owner), attr=attr, ctx=ast.Load()) if (
                    owner == receiver and attr not in stored
                ):
                    found.setdefault(attr, node)
        stored.update(node.attr for node in _stores(walk([statement])))
    return found


def _before_body(statement: ast.stmt) -> Iterator[ast.AST]:
    """Yield what a statement evaluates before the statements within it."""
    match statement:
        case ast.If(test=head) | ast.While(test=head) | ast.Match(subject=head):
            yield from evaluated(head)
        case ast.For(iter=head) | ast.AsyncFor(iter=head):
            yield from evaluated(head)
        case ast.With(items=[first, *_]) | ast.AsyncWith(items=[first, *_]):
            yield from evaluated(first.context_expr)
        case ast.Try() | ast.TryStar():
            pass  # it may expect that the attribute is missing
        case _:
            yield from evaluated(statement)


def _stores(nodes: Iterable[ast.AST]) -> Iterator[ast.Attribute]:
    for node in nodes:
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node


@lru_cache(maxsize=512)
def _first_stores(function: Function) -> Mapping[str, int]:
    """Return the first lines in which a method sets attributes, by their names."""
    found: dict[str, int] = {}
    for node in _stores(nodes_of(function)):
        found[node.attr] = min(node.lineno, found.get(node.attr, node.lineno))
    return found


def _in_texts(methods: _Methods) -> set[str]:
    """Return the texts in methods: a name in ``hasattr(self, "name")`` is expected to miss."""
    return {
        node.value
        for function, _ in methods.values()
        for node in nodes_of(function)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }


def _stored(methods: _Methods) -> tuple[dict[str, set[str]], dict[str, set[str]]]:
    """Return the methods that set an attribute of the object to None, and to other values."""
    none: dict[str, set[str]] = {}
    values: dict[str, set[str]] = {}
    for method, (function, _) in methods.items():
        to_none: set[int] = set()
        for node in nodes_of(function):
            match node:
                case ast.Assign(targets=targets, value=value) if is_none(value):
                    to_none.update(map(id, targets))
                case ast.AnnAssign(target=target, value=value) if value is None or is_none(value):
                    to_none.add(id(target))
                case ast.Attribute(attr=name, ctx=ast.Store()):
                    found = none if id(node) in to_none else values
                    found.setdefault(name, set()).add(method)
    return none, values


def _reached(names: tuple[str, ...], methods: _Methods) -> set[str]:
    """Return the methods that these methods name, and these themselves."""
    found: set[str] = set()
    pending = list(names)
    while pending:
        name = pending.pop()
        if name not in found and name in methods:
            found.add(name)
            inside = nodes_of(methods[name][0])
            pending += [node.attr for node in inside if isinstance(node, ast.Attribute)]
    return found
