"""The values in a function that must not be None."""

from __future__ import annotations

import ast
from collections.abc import Container, Iterator
from functools import lru_cache

from composer.behavior_checks.calls.arguments import signature_of
from composer.behavior_source import Function
from composer.behavior_source.flow import is_stub
from composer.behavior_source.traversal import walk
from composer.behavior_types.expressions.annotations import allows_none
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.scalars import is_number, is_text
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.values import (
    InterfaceClass,
    ModuleFunction,
    OwnMethod,
)
from composer.field_types import ANYTHING
from composer.interfaces import Message


def needed_values(node: ast.AST, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield the parts of an expression or a statement that fail if they are None."""
    match node:
        case ast.Attribute(value=value) | ast.Subscript(value=value):
            yield value
        case ast.Assign(targets=[ast.Tuple() | ast.List()], value=value):
            yield value
        case ast.For(iter=value) | ast.comprehension(iter=value):
            yield value
        case ast.BinOp(left=left, op=operator, right=right) if not isinstance(operator, ast.Mod):
            if _is_plain(right, scope):
                yield left
            if _is_plain(left, scope):
                yield right
        case ast.AugAssign(target=target, value=value) if _is_plain(target, scope):
            yield value
        case ast.Assign(targets=[ast.Attribute(value=owner)], value=value):
            if isinstance(scope.type_of(owner), Message):
                yield value
        case ast.Call():
            yield from passed_values(node, scope)


def _is_plain(node: ast.expr, scope: FunctionTypes) -> bool:
    found = scope.type_of(node)
    return is_number(found) or is_text(found)


def passed_values(call: ast.Call, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield the arguments of a call for parameters that are annotated as other than None."""
    candidates = (*call.args, *(item.value for item in call.keywords))
    if not any(isinstance(item, ast.Name | ast.Call) for item in candidates):
        return
    match scope.type_of(call.func):
        case InterfaceClass(definition=Message()):
            yield from (item.value for item in call.keywords)
            return
        case OwnMethod(method=method, home=home) if method.node is not None:
            function, is_bound = method.node, True
        case ModuleFunction(node=function, home=home, is_bound=is_bound) if not is_rclpy(home):
            pass
        case _:
            return
    signature = signature_of(function, is_bound=is_bound)
    if signature is None or is_stub(function):
        return
    annotations = _annotations(function)
    for name, argument in signature.bound(call):
        annotation = annotations.get(name)
        if annotation is not None and scope.annotated(annotation, home) is not ANYTHING:
            yield argument


@lru_cache(maxsize=256)
def _annotations(function: Function) -> dict[str, ast.expr]:
    """Return the annotations without None of parameters that a function does not compare."""
    arguments = function.args
    positional = (*arguments.posonlyargs, *arguments.args)
    without = positional[: len(positional) - len(arguments.defaults)]
    keywords = zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
    required = (*without, *(item for item, default in keywords if default is None))
    asked = {
        name
        for node in nodes_of(function)
        if isinstance(node, ast.Compare | ast.BoolOp | ast.UnaryOp | ast.If | ast.IfExp | ast.Match)
        for test in _tests(node)
        for name in direct_names(test)
    }
    return {
        item.arg: item.annotation
        for item in required
        if item.annotation is not None
        and not allows_none(item.annotation)
        and item.arg not in asked
    }


def _tests(node: ast.AST) -> Iterator[ast.expr]:
    match node:
        case ast.Compare(left=left, comparators=others):
            yield from (left, *others)
        case ast.BoolOp(values=values):
            yield from values
        case ast.UnaryOp(operand=operand):
            yield operand
        case ast.If(test=test) | ast.IfExp(test=test):
            yield test
        case ast.Match(subject=subject):
            yield subject


def direct_names(test: ast.expr, passed: Container[int] = ()) -> set[str]:
    """Return the names in a test, and its calls, but not those whose attributes it reads.

    ``passed`` are the ids of arguments that the test does not ask for either.
    """
    owners: set[int] = set()
    found: set[str] = set()
    for node in walk([test]):
        if isinstance(node, ast.Attribute | ast.Subscript):
            owners.add(id(node.value))
        if id(node) in owners or id(node) in passed:
            continue
        if isinstance(node, ast.Name):
            found.add(node.id)
        elif isinstance(node, ast.Call):
            found.add(ast.unparse(node))
    return found
