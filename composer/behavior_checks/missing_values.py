"""Finds values that may be None, and are used without asking for it anywhere in the function."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from composer.behavior_checks.needed_values import direct_names, needed_values, passed_values
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.flow import empty_returns, returned_values
from composer.behavior_source.method_body import catches, dotted, is_none
from composer.behavior_source.spans import span_of
from composer.behavior_source.traversal import walk
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.bindings import How, bindings_of, nodes_of
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.names import constant_named
from composer.behavior_types.values import (
    BuiltinMethod,
    CollectionMethod,
    ModuleFunction,
    OwnMethod,
    OwnObject,
)

_MATCHING = frozenset({"fullmatch", "match", "search"})
_CAUGHT = frozenset({"AttributeError", "BaseException", "Exception", "TypeError"})
_LONGEST = 200


def missing_values(function: Function, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the first use of each value in a function that may be None."""
    nodes = nodes_of(function)
    if not any(isinstance(node, ast.Call) for node in nodes):
        return
    reasons = {
        name: reason
        for name in scope.bindings.names
        if (reason := _reason(scope.bindings.value_of(name), scope)) is not None
    }
    if not reasons and not any(map(_has_direct_use, nodes)):
        return
    if _expects_none(function):
        return
    looks_up = _looks_up(function)
    seen = set(_tested_names(function, scope))
    for node in nodes:
        for used in needed_values(node, scope):
            reason, name = None, used.id if isinstance(used, ast.Name) else ""
            if name and name not in seen:
                reason = reasons.get(name)
            elif isinstance(used, ast.Call):
                reason = _reason(used, scope)
                name = ast.unparse(used) if reason is not None else ""
            if reason is None or name in seen or (looks_up and reason.startswith("'get'")):
                continue
            value = scope.bindings.value_of(name) if isinstance(used, ast.Name) else used
            if _is_certain(node, value, scope):
                seen.add(name)
                span = span_of(used, scope.home.source)
                hint = "check it first, as in 'if ... is not None'"
                yield CodeProblem(Kind.NONE, f"this may be None: {reason}", span, hint)


def _has_direct_use(node: ast.AST) -> bool:
    """Return whether a statement may use what a call returns directly."""
    match node:
        case ast.Attribute(value=ast.Call()) | ast.Subscript(value=ast.Call()):
            return True
        case ast.Assign(targets=[ast.Tuple() | ast.List()], value=ast.Call()):
            return True
        case ast.Call(args=arguments):
            return any(isinstance(item, ast.Call) for item in arguments)
        case _:
            return False


def _is_certain(node: ast.AST, value: ast.expr | None, scope: FunctionTypes) -> bool:
    """Return whether a use is reported: only some are, unless a function declares None.

    A dict may have all keys, and a function may always find what it looks for.
    """
    if isinstance(node, ast.Attribute | ast.Subscript):
        return True
    call = value.value if isinstance(value, ast.Await) else value
    if not isinstance(call, ast.Call):
        return False
    match scope.type_of(call.func):
        case OwnMethod(method=own) if own.node is not None:
            return own.node.returns is not None
        case ModuleFunction(node=function):
            return function.returns is not None
        case CollectionMethod():
            return False
        case _:
            return True


def _reason(node: ast.expr | None, scope: FunctionTypes) -> str | None:
    """Return why a value may be None, None if it is not known to be."""
    call = node.value if isinstance(node, ast.Await) else node
    if isinstance(call, ast.Attribute):
        return _of_property(call, scope)
    if not isinstance(call, ast.Call):
        return None
    name = scope.called_name(call.func)
    if name in {"max", "min", "next"} and _gives_none(name, call):
        return f"'{name}' returns None for nothing"
    if name.startswith("re.") and name.removeprefix("re.") in _MATCHING and call.args:
        return None if _may_be_empty(call.args[0]) else f"'{name}' returns None without a match"
    match scope.type_of(call.func):
        case CollectionMethod(owner=owner, name="get") if owner.python is dict:
            is_plain = len(call.args) == 1 and not call.keywords
            return "'get' returns None for a missing key" if is_plain else None
        case BuiltinMethod(python=python, name=method) if python is re.Pattern:
            is_known = method in _MATCHING and not _may_be_empty(_pattern(call.func, scope))
            return f"'{method}' returns None without a match" if is_known else None
        case OwnMethod(method=own) if own.node is not None:
            return _of_function(own.node)
        case ModuleFunction(node=function):
            return _of_function(function)
        case _:
            return None


def _gives_none(name: str, call: ast.Call) -> bool:
    """Return whether a call of ``max``, ``min`` or ``next`` has a default of None."""
    defaults = [item.value for item in call.keywords if item.arg == "default"]
    defaults += call.args[1:2] if name == "next" else []
    return any(map(is_none, defaults))


def _of_property(node: ast.Attribute, scope: FunctionTypes) -> str | None:
    """Return why a property of an object of the project may be None, None if it may not."""
    owner = scope.type_of(node.value)
    for own in lineage(owner.of).classes if isinstance(owner, OwnObject) else ():
        for method in own.definition.methods:
            if method.name == node.attr and method.node is not None:
                decorators = {dotted(item) for item in method.node.decorator_list}
                returns = method.node.returns
                is_property = decorators == {"property"} and returns is not None
                if is_property and returns is not None and _names_none(returns):
                    return f"'{node.attr}' is None in some cases"
                return None
    return None


def _pattern(function: ast.expr, scope: FunctionTypes) -> ast.expr | None:
    """Return what a pattern of the file is compiled from, None if it is not known."""
    owner = function.value if isinstance(function, ast.Attribute) else None
    name = owner.id if isinstance(owner, ast.Name) else ""
    constant = None if scope.is_local(name) else constant_named(name, scope.home)
    return constant.args[0] if isinstance(constant, ast.Call) and constant.args else None


def _may_be_empty(pattern: ast.expr | None) -> bool:
    """Return whether a pattern matches nothing as well, so that it may match everywhere."""
    text = pattern.value if isinstance(pattern, ast.Constant) else None
    if not isinstance(text, str) or len(text) > _LONGEST:
        return True
    try:
        return re.compile(text).match("") is not None
    except (re.error, RecursionError, OverflowError):
        return True


def _of_function(function: Function) -> str | None:
    if function.decorator_list or any(
        isinstance(node, ast.Yield | ast.YieldFrom) for node in nodes_of(function)
    ):
        return None
    message = f"'{function.name}' returns None in some cases"
    if function.returns is not None:
        return message if _names_none(function.returns) else None
    values = list(returned_values(function))
    if not values or any(isinstance(node, ast.Raise) for node in nodes_of(function)):
        return None
    is_named = any(_is_none_at_first(value, function) for value in values)
    return message if is_named or any(True for _ in empty_returns(function)) else None


def _names_none(annotation: ast.expr) -> bool:
    match annotation:
        case ast.BinOp(left=left, op=ast.BitOr(), right=right):
            return any(
                isinstance(item, ast.Constant) and item.value is None for item in (left, right)
            )
        case ast.Subscript(value=name):
            return dotted(name) in {"Optional", "typing.Optional"}
        case _:
            return False


def _is_none_at_first(value: ast.expr, function: Function) -> bool:
    """Return whether a result is a name that is set to None, and then perhaps, in a loop."""
    bindings = bindings_of(function, is_method=False).names
    found = bindings.get(value.id, []) if isinstance(value, ast.Name) else []
    starts = [item for item in found if is_none(item.expression) and item.how is How.VALUE]
    if not starts or len(found) == len(starts) or not isinstance(value, ast.Name):
        return False
    if value.id in {item.arg for item in walk([function.args]) if isinstance(item, ast.arg)}:
        return False
    in_loops = {
        id(node)
        for loop in nodes_of(function)
        if isinstance(loop, ast.For | ast.AsyncFor)
        for node in walk(loop.body)
    }
    stored = [
        node
        for node in nodes_of(function)
        if isinstance(node, ast.Name) and node.id == value.id and isinstance(node.ctx, ast.Store)
    ]
    outside = sum(id(node) not in in_loops for node in stored)
    tests = (node.test for node in nodes_of(function) if isinstance(node, ast.If))
    asked = (test for test in tests if id(test) not in in_loops)
    return outside == len(starts) == 1 and not any(value.id in direct_names(test) for test in asked)


def _expects_none(function: Function) -> bool:
    """Return whether a function catches what a use of None raises."""
    for node in nodes_of(function):
        match node:
            case ast.ExceptHandler() if catches(node, _CAUGHT):
                return True
            case ast.Name(id="suppress") | ast.Attribute(attr="suppress"):
                return True
    return False


def _looks_up(function: Function) -> bool:
    """Return whether a function asks for keys, so that 'get' finds them."""
    return any(
        isinstance(node, ast.Compare)
        and any(isinstance(item, ast.In | ast.NotIn) for item in node.ops)
        for node in nodes_of(function)
    )


def _tested_names(function: Function, scope: FunctionTypes) -> set[str]:
    """Return the names and calls whose values a function asks for."""
    found: set[str] = set()
    nodes = nodes_of(function)
    passed = {
        id(item)
        for node in nodes
        if isinstance(node, ast.Call)
        for item in passed_values(node, scope)
    }
    for node in nodes:
        match node:
            case (
                ast.If(test=test)
                | ast.While(test=test)
                | ast.IfExp(test=test)
                | ast.Assert(test=test)
            ):
                found |= direct_names(test, passed)
            case ast.BoolOp(values=values):
                found.update(*(direct_names(value, passed) for value in values))
            case ast.UnaryOp() | ast.Compare():
                found |= direct_names(node, passed)
            case ast.comprehension(ifs=tests):
                found.update(*(direct_names(test, passed) for test in tests))
            case ast.NamedExpr(target=ast.Name(id=name)):
                found.add(name)
            case ast.Match(subject=subject):
                found |= direct_names(subject)
            case ast.Call(args=arguments):  # another function may ask
                names = (item for item in arguments if isinstance(item, ast.Name))
                found.update(item.id for item in names if id(item) not in passed)
    return found
