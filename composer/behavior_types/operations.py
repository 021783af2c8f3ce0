"""Checks operations, calls and statements that fail or have no effect."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Iterator, Mapping
from itertools import pairwise

from composer import behavior
from composer.behavior_source import Function, Module
from composer.behavior_source.flow import returned_values
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of, start_span
from composer.behavior_types.annotations import annotated
from composer.behavior_types.arguments import Signature, math_signature
from composer.behavior_types.expressions import FunctionTypes
from composer.behavior_types.fitting import argument_problem
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.operators import (
    is_float,
    is_scalar,
    operation_problem,
    order_problem,
)
from composer.behavior_types.problems import CodeProblem, Kind
from composer.behavior_types.values import (
    ApiMethod,
    ApiValue,
    Collection,
    ModuleFunction,
    OwnMethod,
    OwnObject,
    Parameters,
    Ports,
    Value,
)
from composer.field_types import Word, described
from composer.interfaces import FieldType, Message


def call_problems(
    call: ast.Call,
    signature: Signature,
    scope: FunctionTypes,
    expected: Mapping[str, Value] | None = None,
) -> Iterator[CodeProblem]:
    """Yield why a call fails: its arguments, or one that contradicts an ``expected`` type."""
    source = scope.home.source
    problem = signature.problem(call)
    if problem is not None:
        message, node, hint = problem
        if isinstance(node, ast.keyword):
            span = start_span(node, len(str(node.arg)), source)
        else:
            span = span_of(node, source)
        yield CodeProblem(Kind.CALL, message, span, hint)
        return
    for name, argument in signature.bound(call):
        if expected is not None and name in expected:
            wrong = argument_problem(argument, scope.type_of(argument), expected[name])
            if wrong is not None:
                message = f"argument '{name}' of '{signature.name}': {wrong}"
                yield CodeProblem(Kind.CALL, message, span_of(argument, source))


def annotations_by_name(
    function: Function, home: Module, types: BehaviorTypes
) -> Mapping[str, Value]:
    """Return the types that the annotations of the parameters of a function name."""
    arguments = function.args
    return {
        argument.arg: annotated(argument.annotation, home, types.node, types.interfaces)
        for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
        if argument.annotation is not None
    }


def annotations_of(function: Function) -> Iterator[ast.expr]:
    """Yield the annotations of the parameters and of the result of a function."""
    arguments = function.args
    for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        if argument.annotation is not None:
            yield argument.annotation
    if function.returns is not None:
        yield function.returns


def uncallable(value: Value) -> tuple[str, str | None] | None:
    """Return why a value cannot be called, and a hint; None if it may be."""
    match value:
        case ApiValue(class_name="Publisher"):
            return "a Publisher is not a function", "call its method 'publish'"
        case ApiValue(class_name=name):
            return f"a {name} is not a function", None
        case Ports() | Parameters():
            return "this is not a function", None
        case Message() | OwnObject():
            name = value.name if isinstance(value, Message) else value.of.definition.name
            return (f"{name} is not a function", None) if isinstance(value, Message) else None
        case FieldType() if is_scalar(value) or value.is_array:
            return f"{described(value)} is not a function", None
        case _:
            return None


def operation_problems(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the problems of an operation or a statement."""
    source = scope.home.source
    match node:
        case ast.BinOp(left=left, op=operator, right=right):
            problem = operation_problem(scope.type_of(left), operator, scope.type_of(right))
            if problem is not None:
                yield CodeProblem(Kind.VALUE, problem, span_of(node, source))
        case ast.Subscript(value=owner, slice=index):
            problem = _index_problem(scope.type_of(owner), scope.type_of(index))
            if problem is not None:
                yield CodeProblem(Kind.VALUE, problem, span_of(index, source))
        case ast.Call(func=ast.Name(id="len"), args=[argument]):
            found = scope.type_of(argument)
            if isinstance(found, Message) or (is_scalar(found) and found != _TEXT):
                message = f"{described(found)} has no length"  # type: ignore[arg-type]
                yield CodeProblem(Kind.VALUE, message, span_of(argument, source))
        case ast.Compare(left=left, ops=[ast.Eq() | ast.NotEq()], comparators=[right]):
            for word, other in ((scope.type_of(left), right), (scope.type_of(right), left)):
                constant = other.value if isinstance(other, ast.Constant) else None
                never = word.problem(constant) if isinstance(word, Word) else None
                if never is not None:
                    yield CodeProblem(Kind.VALUE, never[0], span_of(other, source), never[1])
        case ast.Compare(left=left, ops=operators, comparators=others):
            values = [scope.type_of(item) for item in (left, *others)]
            for (first, second), sign in zip(pairwise(values), operators, strict=True):
                problem = order_problem(first, sign, second)
                if problem is not None:
                    yield CodeProblem(Kind.VALUE, problem, span_of(node, source))
        case ast.Call(func=function) if called := scope.called_name(function):
            yield from _library_call(node, called, scope)
        case ast.Expr(value=value):
            yield from _unused(value, scope)
        case ast.Await(value=ast.Call(func=function)):
            name = scope.global_name(dotted(function))
            if name.startswith("asyncio.") and not _runs_asyncio(scope.home):
                message = f"'{name}' needs the event loop of asyncio, which does not run here"
                hint = "use self.clock.sleep" if name == "asyncio.sleep" else None
                yield CodeProblem(Kind.ASYNCIO, message, span_of(function, source), hint)


def _library_call(call: ast.Call, name: str, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Check a call of ``range``, or of a function in ``math``."""
    if name == "range":
        for argument in call.args:
            if is_float(scope.type_of(argument)):
                span = span_of(argument, scope.home.source)
                yield CodeProblem(
                    Kind.VALUE, "'range' takes integers, not a float", span, "write int(...)"
                )
    elif name.startswith("math."):
        signature = math_signature(name.removeprefix("math."))
        if signature is not None:
            yield from call_problems(call, signature, scope)


def returned_exceptions(function: Function, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the exceptions that a function returns although its result is not used."""
    returns = function.returns
    if returns is None and not function.name.startswith("on_"):
        return
    if returns is not None and not (isinstance(returns, ast.Constant) and returns.value is None):
        return
    for value in returned_values(function):
        if isinstance(value, ast.Call) and _is_exception(scope.called_name(value.func)):
            message = "an exception is returned, not raised"
            span = span_of(value, scope.home.source)
            yield CodeProblem(Kind.UNUSED, message, span, "write 'raise' instead of 'return'")


def _is_exception(name: str) -> bool:
    module, _, last = name.rpartition(".")
    home = {"": builtins, "composer.behavior": behavior}.get(module)
    found = getattr(home, last, None)
    return isinstance(found, type) and issubclass(found, Exception)


def _runs_asyncio(home: Module) -> bool:
    """Return whether a file may run an event loop of asyncio, such as in a thread."""
    starts = ("asyncio.run(", "run_until_complete", "run_forever", "asyncio.Runner")
    return any(start in home.source.text for start in starts)


_TEXT = FieldType("string")


def _index_problem(owner: Value, index: Value) -> str | None:
    is_list = isinstance(owner, FieldType) and owner.is_array
    is_sequence = isinstance(owner, Collection) and owner.python in (list, tuple, bytes)
    if (is_list or is_sequence) and is_float(index):
        return "an index must be an integer, not a float"
    if isinstance(owner, Message) or (is_scalar(owner) and owner != _TEXT):
        return f"{described(owner)} is not a list"  # type: ignore[arg-type]
    return None


def _unused(value: ast.expr, scope: FunctionTypes) -> Iterator[CodeProblem]:
    source = scope.home.source
    match value:
        case ast.Compare(ops=[ast.Eq(), *_]):
            message = "the result of this comparison is not used"
            yield CodeProblem(Kind.UNUSED, message, span_of(value, source), "assign with '='")
        case ast.Attribute(attr=name) | ast.Name(id=name):
            found = scope.type_of(value)
            if isinstance(found, OwnMethod | ModuleFunction | ApiMethod):
                message = f"'{name}' is not called"
                yield CodeProblem(Kind.UNUSED, message, span_of(value, source), "add '()'")
