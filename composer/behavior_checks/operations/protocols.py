"""Checks what is awaited, entered by ``with``, or given an index, although it cannot be."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from inspect import isabstract
from types import GeneratorType

from composer.behavior_checks.fitting import shown
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.flow import is_stub, yields
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.functions import definition_of, function_name
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.libraries.standard_types import is_asynchronous
from composer.behavior_types.scalars import is_scalar, is_text
from composer.behavior_types.syntax.own_classes import (
    all_fields,
    has_fields,
    is_named_tuple,
    is_plain,
    known_attributes,
)
from composer.behavior_types.values import (
    NONE,
    AnyFunction,
    ApiMethod,
    Collection,
    ModuleFunction,
    OwnMethod,
    OwnObject,
    Pending,
    Value,
)
from composer.interfaces import FieldType, Message

#: The nodes that are checked here.
CHECKED = (ast.AsyncFor, ast.Await, ast.Expr, ast.Subscript, ast.With)
_OF_ITEMS: Mapping[type[ast.expr_context], str] = {
    ast.Load: "__getitem__",
    ast.Store: "__setitem__",
    ast.Del: "__delitem__",
}


def protocol_problems(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield why a value cannot be awaited, entered or given an index."""
    match node:
        case ast.Await(value=value):
            yield from _awaited(value, scope)
        case ast.With(items=items):
            for item in items:
                yield from _entered(item.context_expr, scope)
        case ast.AsyncFor(iter=iterated):
            kind = _kind(scope.type_of(iterated), "__aiter__", scope)
            if kind is not None:
                span = span_of(iterated, scope.home.source)
                yield CodeProblem(Kind.VALUE, f"{kind} is not asynchronous", span, "write 'for'")
        case ast.Expr(value=ast.Call(func=function) as call):
            called = definition_of(scope.type_of(function))
            if called is not None and not called.decorator_list and any(yields(called)):
                message = f"'{called.name}' is a generator: nothing happens without a loop over it"
                yield CodeProblem(Kind.UNUSED, message, span_of(call, scope.home.source))
        case ast.Subscript():
            yield from _subscripted(node, scope)


def _awaited(node: ast.expr, scope: FunctionTypes) -> Iterator[CodeProblem]:
    found, span = scope.type_of(node), span_of(node, scope.home.source)
    name = _function_name(found)
    if name and isinstance(node, ast.Attribute | ast.Name):
        message = f"the function '{name}' cannot be awaited"
        yield CodeProblem(Kind.VALUE, message, span, f"call it: {name}()")
        return
    if is_asynchronous(found):
        message = "an async generator cannot be awaited"
        yield CodeProblem(Kind.VALUE, message, span, "write 'async for'")
    elif isinstance(node, ast.Call):
        function = scope.type_of(node.func)
        name = _plain_function(node, function, found, scope)
        if name:
            message = f"'{name}' is not asynchronous, so that it cannot be awaited"
            span = span_of(node.func, scope.home.source)
            yield CodeProblem(Kind.VALUE, message, span, "remove 'await'")


def _plain_function(node: ast.Call, function: Value, result: Value, scope: FunctionTypes) -> str:
    """Return the name of a function that returns nothing awaitable, "" if it may."""
    if isinstance(function, ApiMethod):
        return "" if function.member.is_async else function.member.name
    if isinstance(function, AnyFunction):
        return ast.unparse(node.func) if _kind(result, "__await__", scope) is not None else ""
    called = definition_of(function)
    if called is None or isinstance(called, ast.AsyncFunctionDef) or called.decorator_list:
        return ""
    is_other = isinstance(function, ModuleFunction) and function.is_bound and function.of is None
    if is_other or is_stub(called):
        return ""  # another class may define it differently
    is_plain = result is NONE or _kind(result, "__await__", scope) is not None
    return called.name if is_plain else ""


def _entered(node: ast.expr, scope: FunctionTypes) -> Iterator[CodeProblem]:
    found, span = scope.type_of(node), span_of(node, scope.home.source)
    name = _function_name(found)
    if name and isinstance(node, ast.Attribute):
        message = f"the function '{name}' is not a context manager"
        yield CodeProblem(Kind.VALUE, message, span, f"call it: {name}()")
        return
    called = definition_of(scope.type_of(node.func)) if isinstance(node, ast.Call) else None
    if called is not None and called.decorator_list:
        return
    kind = _kind(found, "__enter__", scope)
    if kind is not None:
        is_generator = isinstance(found, Collection) and found.python in (GeneratorType, Iterator)
        hint = f"decorate '{called.name}' with @contextmanager" if called and is_generator else None
        yield CodeProblem(Kind.VALUE, f"{kind} is not a context manager", span, hint)


def _subscripted(node: ast.Subscript, scope: FunctionTypes) -> Iterator[CodeProblem]:
    owner, span = scope.type_of(node.value), span_of(node.slice, scope.home.source)
    needed = _OF_ITEMS[type(node.ctx)]
    is_tuple = isinstance(owner, OwnObject) and is_named_tuple(owner.of)
    if needed != "__getitem__" and (is_text(owner) or is_tuple):
        yield CodeProblem(Kind.VALUE, f"{shown(owner)} cannot be changed", span)
        return
    if not isinstance(owner, Collection | OwnObject):
        return
    kind = _kind(owner, needed, scope)
    if kind is None:
        return
    if isinstance(owner, Collection):
        is_fixed = hasattr(owner.python, "__getitem__")
        problem = "cannot be changed" if is_fixed else "has no items to index"
        hint: str | None = "write list(...)"
    else:
        problem = "has no items"
        fields = all_fields(owner.of) if has_fields(owner.of) else ()
        name = node.slice.value if isinstance(node.slice, ast.Constant) else None
        hint = next((f"write .{field.name}" for field in fields if field.name == name), None)
    yield CodeProblem(Kind.VALUE, f"{kind} {problem}", span, hint)


def _function_name(found: Value) -> str:
    """Return the name of a function of the project or the API, "" if a decorator may change it."""
    if isinstance(found, ModuleFunction) and not found.is_bound and found.node.decorator_list:
        return ""
    is_known = isinstance(found, ApiMethod | ModuleFunction | OwnMethod)
    return function_name(found) if is_known else ""


def _kind(found: Value, method: str, scope: FunctionTypes) -> str | None:
    """Return what a value is if it lacks a special method, None if it may have it."""
    match found:
        case Collection(python=python):
            has_it = hasattr(python, method)
            # an annotation such as Iterable may stand for a class with further methods
            is_open = isabstract(python) and (python is not Iterator or method != "__enter__")
            return None if has_it or is_open else shown(found)
        case Message():
            return shown(found)
        case FieldType() if is_scalar(found):
            return shown(found)
        case OwnObject(of=of) if is_named_tuple(of):
            known_names = known_attributes(of)
            may_have = known_names is None or method in known_names or hasattr(tuple, method)
            return None if may_have else shown(found)
        case OwnObject(of=of) if is_plain(of) and not is_rclpy(of.home):
            classes = (of, *scope.owner.project_classes.derived(of))
            known = [known_attributes(item) for item in classes]
            may_have = any(names is None or method in names for names in known)
            return None if may_have else shown(found)
        case Pending(name=name) if method == "__enter__":
            return f"the awaitable of '{name}'"
        case _:
            return None
