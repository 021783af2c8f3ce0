"""Checks what is looked up: by 'in', in enumerations, and what methods return that change lists."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.parameter_values import parameter_values
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.operators import equality_problem
from composer.behavior_types.functions import is_function
from composer.behavior_types.libraries.standard_types import IN_PLACE
from composer.behavior_types.scalars import is_number, is_text
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.own_classes import is_enumeration, known_attributes
from composer.behavior_types.values import (
    NONE,
    Collection,
    CollectionMethod,
    OwnClass,
    OwnObject,
    Value,
)
from composer.diagnostics import suggestion
from composer.field_types import ANYTHING
from composer.interfaces import FieldType, Message

#: The nodes that are checked here, besides attributes.
LOOKUPS = (ast.Assign, ast.Compare, ast.Dict, ast.For, ast.Set, ast.Subscript)
_SEVERAL = (list, dict, set)


def lookup_problems(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield why a lookup fails, or finds nothing."""
    match node:
        case ast.Compare(left=left, ops=[ast.In() | ast.NotIn()], comparators=[owner]):
            yield from _membership(left, owner, scope)
        case ast.Set(elts=items):
            yield from _hashed(items, scope, "an element of a set")
        case ast.Dict(keys=keys):
            yield from _hashed([key for key in keys if key is not None], scope, "a key")
        case ast.Assign(value=value) | ast.For(iter=value):
            yield from _nothing(value, scope)
        case ast.Subscript(value=value):
            yield from _nothing(value, scope)
            yield from _member(node, scope)
        case ast.Attribute(value=value):
            yield from _nothing(value, scope)


def _membership(left: ast.expr, owner: ast.expr, scope: FunctionTypes) -> Iterator[CodeProblem]:
    found, whole = scope.type_of(left), scope.type_of(owner)
    source = scope.home.source
    if is_number(whole) or isinstance(whole, Message) or is_function(whole):
        message = f"{shown(whole)} has no elements to look for"
        yield CodeProblem(Kind.VALUE, message, span_of(owner, source))
        return
    if isinstance(whole, OwnObject):
        names = [known_attributes(whole.of)]
        names += map(known_attributes, scope.owner.project_classes.derived(whole.of))
        needed = {"__contains__", "__getitem__", "__iter__"}
        if all(known is not None and not known & needed for known in names):
            message = f"{shown(whole)} has no elements to look for"
            yield CodeProblem(Kind.VALUE, message, span_of(owner, source))
        return
    if is_text(whole):
        if kind_of(found) not in (None, "text"):
            message = f"{shown(found)} cannot be in a string"
            yield CodeProblem(Kind.VALUE, message, span_of(left, source))
        return
    if isinstance(whole, Collection) and _never_in(found, whole, scope):
        message = f"this is never in it: {shown(found)} in {shown(whole)} of other values"
        yield CodeProblem(Kind.VALUE, message, span_of(left, source))


def _never_in(found: Value, whole: Collection, scope: FunctionTypes) -> bool:
    elements = whole.items or (scope.element(whole),)
    return not whole.is_empty and all(_never_equal(found, element) for element in elements)


def _never_equal(found: Value, element: Value) -> bool:
    if ANYTHING in (found, element) or NONE in (found, element):
        return False
    if equality_problem(found, element) is not None:
        return True
    kinds = {kind_of(found), kind_of(element)}
    return kinds == {"number", "text"}


def _hashed(items: list[ast.expr], scope: FunctionTypes, what: str) -> Iterator[CodeProblem]:
    for item in items:
        found = scope.type_of(item)
        is_list = isinstance(found, Collection) and found.python in _SEVERAL
        if is_list or isinstance(found, Message):
            message = f"{shown(found)} cannot be {what}"
            yield CodeProblem(Kind.VALUE, message, span_of(item, scope.home.source))
            return


def _nothing(value: ast.expr, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the use of what ``sort``, ``append`` and the like return: None."""
    if not isinstance(value, ast.Call) or scope.type_of(value) is not NONE:
        return
    called = scope.type_of(value.func)
    if isinstance(called, CollectionMethod) and called.name in IN_PLACE:
        kind = called.owner.python.__name__
        message = f"'{called.name}' changes the {kind} itself, and returns nothing"
        hint = "write sorted(...)" if called.name == "sort" else f"call '{called.name}' before"
        yield CodeProblem(Kind.VALUE, message, span_of(value, scope.home.source), hint)


def _member(node: ast.Subscript, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the name that an enumeration lacks, or a number: ``Mode["FASTT"]``, ``Mode[1]``."""
    own = scope.type_of(node.value)
    if not isinstance(own, OwnClass) or not is_enumeration(own):
        return
    if is_number(scope.type_of(node.slice)):
        class_name = own.definition.name
        message = f"'{class_name}' has its members by name, not by number"
        span = span_of(node.slice, scope.home.source)
        yield CodeProblem(Kind.VALUE, message, span, f"by value: {class_name}(...)")
        return
    known = _member_names(own) if known_attributes(own) is not None else None
    for name in _names(node.slice, scope):
        if known is not None and name not in known:
            is_here = isinstance(node.slice, ast.Constant)
            message = f"'{own.definition.name}' has no member '{name}'"
            message += "" if is_here else " for this parameter"
            names = [item for item in known if not item.startswith("_")]
            span = span_of(node.slice, scope.home.source)
            yield CodeProblem(Kind.ATTRIBUTE, message, span, suggestion(name, names))
            return


def _member_names(own: OwnClass) -> set[str]:
    return {
        target.id
        for item in lineage(own).classes
        for statement in item.definition.node.body
        if isinstance(statement, ast.Assign)
        for target in statement.targets
        if isinstance(target, ast.Name)
    }


def _names(node: ast.expr, scope: FunctionTypes) -> list[str]:
    """Return the text that an expression is, or the choices of a parameter that it reads."""
    if isinstance(node, ast.Constant):
        return [node.value] if isinstance(node.value, str) else []
    return [item for item in parameter_values(node, scope) if isinstance(item, str)]


def enumeration_problems(
    call: ast.Call, own: OwnClass, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield the value that no member of an enumeration has, as in ``Mode("fastt")``."""
    given = call.args[0] if len(call.args) == 1 and not call.keywords else None
    if given is None or not is_enumeration(own, *_PLAIN_ENUMS):
        return
    family = lineage(own)
    values: list[object] = []
    for item in family.classes:
        if any(method.node is not None for method in item.definition.methods):
            return  # it may compute values
        for statement in item.definition.node.body:
            match statement:
                case ast.Assign(targets=[ast.Name()], value=ast.Constant(value=value)):
                    values.append(value)
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call(func=function)):
                    if scope.owner.at_module(item.home).called_name(function) != "enum.auto":
                        return
                    is_text = is_enumeration(own, "enum.StrEnum")
                    values.append(name.lower() if is_text else len(values) + 1)
                case ast.Expr() | ast.Pass():
                    pass
                case _:
                    return
    expected = [given.value] if isinstance(given, ast.Constant) else parameter_values(given, scope)
    missing = [item for item in expected if item not in values] if values else []
    if missing:
        message = f"no member of '{own.definition.name}' has the value {missing[0]!r}"
        message += "" if isinstance(given, ast.Constant) else " of this parameter"
        yield CodeProblem(Kind.VALUE, message, span_of(given, scope.home.source))


_PLAIN_ENUMS = ("enum.Enum", "enum.IntEnum", "enum.StrEnum")


def conversion_problems(call: ast.Call, name: str, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Check calls of ``float``, ``int``, ``next``, ``abs``, ``round`` and ``isinstance``."""
    if not call.args or isinstance(call.args[0], ast.Starred):
        return
    first = call.args[0]
    found, kind = scope.type_of(first), kind_of(scope.type_of(first))
    problem, hint, where = None, None, first
    if name in {"float", "int"}:
        is_wrong = isinstance(found, Message) or kind in ("dict", "function", "tuple")
        if is_wrong or (isinstance(found, Collection) and found.python in _CONTAINERS):
            problem = f"'{name}' takes a number or a string, not {shown(found)}"
    elif name in {"abs", "round"}:
        is_wrong = isinstance(found, Message) or kind in ("dict", "function", "text", "tuple")
        if is_wrong or (isinstance(found, Collection) and found.python in _CONTAINERS):
            problem = f"'{name}' takes a number, not {shown(found)}"
    elif name == "next":
        is_array = isinstance(found, FieldType) and found.is_array
        if is_array or (isinstance(found, Collection) and found.python in _CONTAINERS):
            problem = f"'next' takes an iterator, not {shown(found)}"
            hint = "write next(iter(...))"
    elif name in {"isinstance", "issubclass"} and len(call.args) > 1:
        where = call.args[1]
        is_literal = isinstance(where, ast.Constant) and where.value is not None
        if is_literal or isinstance(where, ast.List | ast.Set | ast.Dict):
            problem = f"'{name}' needs a class or a tuple of classes"
            hint = "write (...)" if isinstance(where, ast.List | ast.Set) else None
    if problem is not None:
        yield CodeProblem(Kind.VALUE, problem, span_of(where, scope.home.source), hint)


_CONTAINERS = (dict, list, range, set, tuple)
CONVERSIONS = frozenset({"abs", "float", "int", "isinstance", "issubclass", "next", "round"})
