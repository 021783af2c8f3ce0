"""What functions put into collections that are empty at first."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import field
from functools import lru_cache
from typing import TYPE_CHECKING

from composer.behavior_source import Function, Module
from composer.behavior_source.method_body import dotted
from composer.behavior_types.syntax.bindings import bindings_of, nodes_of
from composer.behavior_types.syntax.names import full_name, interface_name
from composer.behavior_types.values import (
    NONE,
    Collection,
    ModuleFunction,
    OwnMethod,
    Parameters,
    Pending,
    Ports,
    Self,
    Value,
    join,
)
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING

if TYPE_CHECKING:
    from composer.behavior_types.expressions.function_types import FunctionTypes

_ADDING = frozenset({"add", "append", "appendleft"})
_SPREADING = frozenset({"extend", "extendleft", "update"})
#: Methods that put nothing into a collection and do not pass it on.
_KEEPING = frozenset(
    {"clear", "copy", "count", "difference", "discard", "get", "index", "intersection"}
    | {"isdisjoint", "issubset", "issuperset", "items", "keys", "maxlen", "pop", "popitem"}
    | {"popleft", "remove", "reverse", "rotate", "sort", "values"}
)
_TAKING = frozenset(
    {"all", "any", "bool", "dict", "enumerate", "filter", "frozenset", "iter", "len", "list"}
    | {"map", "max", "min", "next", "print", "repr", "reversed", "set", "sorted", "str", "sum"}
    | {"tuple", "zip"}
)


@dataclass(frozen=True, slots=True)
class Filling:
    """An element that is put into a collection, with its key in a dict.

    If ``is_spread``, these are the elements of ``value``. A ``value`` of None may be anything.
    """

    value: ast.expr | None
    key: ast.expr | None = None
    is_spread: bool = False


@dataclass(slots=True)
class Fillings:
    """What a function puts into the attributes of its object, and into its names.

    ``passed_on`` are the attributes and names that other code may fill. An attribute is written
    with a dot.
    """

    found: dict[str, list[Filling]] = field(default_factory=dict)
    passed_on: set[str] = field(default_factory=set)


@lru_cache(maxsize=512)
def fillings_of(function: Function, home: Module) -> Fillings:
    """Return what a function puts into collections."""
    return _Reader(bindings_of(function).receiver, home).read(function)


class _Reader:
    def __init__(self, receiver: str | None, home: Module) -> None:
        self._receiver = receiver
        self._home = home
        self._found = Fillings()
        self._safe: set[int] = set()

    def read(self, function: Function) -> Fillings:
        nodes = nodes_of(function)
        for node in nodes:
            self._visit(node)
        for node in nodes:
            name = self._named(node)
            is_read = isinstance(getattr(node, "ctx", None), ast.Load)
            if name and is_read and id(node) not in self._safe:
                self._found.passed_on.add(name)
        return self._found

    def _named(self, node: ast.AST) -> str:
        match node:
            case ast.Name(id=name):
                return name
            case ast.Attribute(value=ast.Name(id=owner), attr=name) if owner == self._receiver:
                return f".{name}"
            case _:
                return ""

    def _put(self, owner: ast.expr, filling: Filling) -> None:
        name = self._named(owner)
        if name:
            self._found.found.setdefault(name, []).append(filling)
            self._safe.add(id(owner))

    def _visit(self, node: ast.AST) -> None:
        match node:
            case ast.Call(func=ast.Attribute(value=owner, attr=name), args=arguments):
                self._method(owner, name, arguments, has_more=bool(node.keywords))
                self._arguments(node)
            case ast.Call():
                self._arguments(node)
            case ast.Attribute(value=owner, attr=name) if name in _KEEPING or self._named(node):
                self._safe.add(id(owner))
            case ast.Assign(targets=targets, value=value):
                self._assigned(targets, value)
            case ast.AugAssign(target=ast.Subscript(value=owner) as target):
                self._safe.add(id(target))
                self._put(owner, Filling(None))
            case ast.AugAssign(target=target, value=value):
                self._put(target, Filling(value, is_spread=True))
            case ast.Subscript(value=owner, ctx=context):
                if isinstance(context, ast.Store) and id(node) not in self._safe:
                    self._put(owner, Filling(None))
                self._safe.add(id(owner))
            case _:
                self._safe.update(map(id, _only_read(node)))

    def _method(
        self, owner: ast.expr, name: str, arguments: list[ast.expr], *, has_more: bool
    ) -> None:
        if has_more and name in _SPREADING:
            self._put(owner, Filling(None))
            return
        match name, arguments:
            case _, [value] if name in _ADDING:
                self._put(owner, Filling(value))
            case _, [value] if name in _SPREADING:
                self._put(owner, Filling(value, is_spread=True))
            case "insert", [_, value]:
                self._put(owner, Filling(value))
            case "setdefault", [key, value]:
                self._put(owner, Filling(value, key))

    def _arguments(self, call: ast.Call) -> None:
        """Note what a call does not change: built-in functions, and messages that are created."""
        name = dotted(call.func)
        if name in _TAKING and name not in self._home.imports:
            self._safe.update(map(id, call.args))
        elif name and interface_name(full_name(name, self._home))[0]:
            self._safe.update(id(item.value) for item in call.keywords)

    def _assigned(self, targets: list[ast.expr], value: ast.expr) -> None:
        for target in targets:
            match target:
                case ast.Subscript(value=owner, slice=ast.Slice()):
                    self._safe.add(id(target))
                    self._put(owner, Filling(value, is_spread=True))
                case ast.Subscript(value=owner, slice=key):
                    self._safe.add(id(target))
                    self._put(owner, Filling(value, key))
                case ast.Attribute() if not self._named(target):  # a field of a message
                    self._safe.add(id(value))


def _only_read(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the expressions that a statement or an operation reads and does not pass on."""
    match node:
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            yield from _tested(test)
        case ast.UnaryOp(operand=operand):
            yield from _tested(operand)
        case ast.Compare(left=left, comparators=others):
            yield from (left, *others)
        case ast.For(iter=iterated) | ast.comprehension(iter=iterated):
            yield iterated
        case ast.BinOp(left=left, right=right):
            yield from (left, right)
        case ast.FormattedValue(value=value) | ast.Starred(value=value):
            yield value
        case ast.Return(value=ast.Name() as value):
            yield value


def _tested(node: ast.expr) -> Iterator[ast.expr]:
    if isinstance(node, ast.BoolOp):
        for value in node.values:
            yield from _tested(value)
    else:
        yield node


_FRESH = frozenset({"OrderedDict", "defaultdict", "deque", "dict", "list", "set"})


def is_fresh(node: ast.expr | None) -> bool:
    """Return whether an expression creates a collection, which nothing else refers to."""
    if isinstance(node, ast.Call):
        return dotted(node.func).removeprefix("collections.") in _FRESH
    return isinstance(node, ast.Dict | ast.List | ast.Set)


def filled(empty: Collection, fillings: Iterable[tuple[FunctionTypes, Filling]]) -> Collection:
    """Return the type of a collection that is empty at first, and gets these elements."""
    element: Value = NONE
    key: Value = NONE
    for scope, filling in fillings:
        more, its_key = _added(scope, filling, empty.python)
        element, key = join(element, more), join(key, its_key)
    is_open = element is ANYTHING and key is ANYTHING
    return Collection(empty.python, element, key, is_empty=is_open)


def _added(scope: FunctionTypes, filling: Filling, python: type) -> tuple[Value, Value]:
    """Return the types of an element and of its key."""
    value = filling.value
    if value is None or (isinstance(value, ast.Constant) and value.value is None):
        return ANYTHING, ANYTHING  # None is the place of a value of any type
    found = scope.type_of(value)
    if filling.is_spread:
        if isinstance(found, Collection) and found.is_empty and is_fresh(value):
            return NONE, NONE
        if python is dict:
            if not isinstance(found, Collection) or found.python is not dict:
                return ANYTHING, ANYTHING
            return found.element, found.key
        return scope.element(found), NONE
    if python is not dict:
        return plain(found), NONE
    key = scope.type_of(filling.key) if filling.key is not None else ANYTHING
    return plain(found), plain(key)


def without_none(found: Collection) -> Collection:
    """Return a type whose elements are not known if nothing is known to be put in."""
    element = ANYTHING if found.element is NONE else found.element
    key = ANYTHING if found.key is NONE else found.key
    is_open = element is ANYTHING and key is ANYTHING
    return Collection(found.python, element, key, is_empty=is_open)


def plain(value: Value) -> Value:
    """Return a type that is the same in another round; ANYTHING for functions and awaitables."""
    match value:
        case Collection(python=python, element=element, key=key, items=items):
            parts = tuple(map(plain, items)) if items is not None else None
            return Collection(python, plain(element), plain(key), parts, value.is_empty)
        case ModuleFunction() | OwnMethod() | Pending() | Self() | Ports() | Parameters():
            return ANYTHING
        case _:
            return value
