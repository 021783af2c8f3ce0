"""Checks what a class gives to rclpy: classes of messages, callbacks and other arguments."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator

from composer.behavior_checks.annotated_values import argument_problem
from composer.behavior_checks.calls.arguments import signature_of
from composer.behavior_checks.calls.call import call_problems
from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_source.syntax import name_span
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.objects import annotation_in
from composer.behavior_types.hosted import Callback, HostedTypes, callbacks_of
from composer.behavior_types.libraries.rclpy_api import CLASSES, rclpy_module
from composer.behavior_types.scalars import is_float, is_integer
from composer.behavior_types.syntax.literals import integer_constant
from composer.behavior_types.values import (
    NONE,
    ApiMethod,
    InterfaceClass,
    ModuleFunction,
    OwnMethod,
    Pending,
    Value,
)
from composer.interfaces import Message
from composer.source import Span

#: The arguments of a callback of a subscription that takes a dict about the message.
_WITH_INFO = 2
_WORDS = {"ActionClass": "an action", "MessageClass": "a message", "ServiceClass": "a service"}


def rclpy_call(
    call: ast.Call,
    called: ModuleFunction,
    scope: FunctionTypes,
    check_message: Callable[[ast.expr, Message], Iterator[CodeProblem]],
) -> Iterator[CodeProblem]:
    """Check a call of a method or a class of rclpy; ``check_message`` checks a message it gets."""
    function, parameter = called.node, called.parameter
    name = ast.unparse(call.func).rpartition(".")[2]
    signature = signature_of(function, is_bound=True, name=name)
    if signature is None:
        return
    found = list(call_problems(call, signature, scope))
    annotations = {
        item.arg: item.annotation for item in (*function.args.args, *function.args.kwonlyargs)
    }
    for argument_name, argument in signature.bound(call) if not found else ():
        annotation = annotations.get(argument_name)
        if annotation is None:
            found += _class_of_group(argument, argument_name, scope)
            continue
        expected = annotation_in(scope, annotation, rclpy_module(), parameter)
        is_class = isinstance(annotation, ast.Name) and annotation.id in CLASSES
        if isinstance(expected, Message) and not is_class:
            found += check_message(argument, expected)
            continue
        wrong = _argument_problem(argument, annotation, parameter, scope)
        if wrong is not None:
            message = f"argument '{argument_name}' of '{signature.name}': {wrong[0]}"
            span = span_of(argument, scope.home.source)
            found.append(CodeProblem(Kind.CALL, message, span, wrong[1]))
            break  # arguments that are swapped are one mistake
    if not found and _is_qos_profile(called):
        found += _qos_problems(call, scope)
    yield from found
    if not found:
        yield from _signature_problems(call, scope)


def _argument_problem(
    node: ast.expr, annotation: ast.expr, parameter: Value, scope: FunctionTypes
) -> tuple[str, str | None] | None:
    """Return why an argument does not fit a parameter of rclpy, and a hint; None if it may."""
    found = scope.type_of(node)
    match annotation:
        case ast.Name(id=name) if name in CLASSES:
            return _class_problem(found, name)
        case ast.Subscript(value=ast.Name(id="Callable")):
            return _function_problem(node, found)
        case ast.BinOp(left=first, op=ast.BitOr(), right=second):
            if _is_depth(annotation) and (integer_constant(node) or 0) < 0:
                return "the depth of a queue cannot be negative", None
            wrong = _argument_problem(node, first, parameter, scope)
            other = _argument_problem(node, second, parameter, scope)
            names = ast.unparse(annotation).replace(" | ", " or ")
            problem = f"{_shown(found)} where {names} is expected"
            return (problem, None) if wrong and other else None
        case _:
            expected = annotation_in(scope, annotation, rclpy_module(), parameter)
            wrong_kind = argument_problem(node, found, expected, scope.type_of)
            if is_integer(expected) and is_float(found):
                wrong_kind = "a float where an int is expected"
            return (wrong_kind, None) if wrong_kind is not None else None


def _is_depth(annotation: ast.expr) -> bool:
    return ast.unparse(annotation) == "QoSProfile | int"


def _class_of_group(node: ast.expr, name: str, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield that a class is given in the place of a callback group."""
    module, _, last = scope.global_name(dotted(node)).rpartition(".")
    if name == "callback_group" and module == "rclpy.callback_groups":
        message = f"argument 'callback_group': the class {last} where an object is expected"
        span = span_of(node, scope.home.source)
        yield CodeProblem(Kind.CALL, message, span, f"create it: {last}()")


def _is_qos_profile(called: ModuleFunction) -> bool:
    profile = rclpy_module().classes["QoSProfile"]
    created = (method.node for method in profile.methods if method.name == "__init__")
    return called.node in created


def _qos_problems(call: ast.Call, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield that a profile has neither a depth nor a history that needs none."""
    given = {item.arg: item.value for item in call.keywords}
    if None in given or "depth" in given:
        return
    history = dotted(given["history"]).rpartition(".")[2] if "history" in given else "KEEP_LAST"
    if history == "KEEP_LAST":
        message = "a QoSProfile needs a depth, unless its history is KEEP_ALL"
        span = span_of(call.func, scope.home.source)
        yield CodeProblem(Kind.CALL, message, span, "add depth=10")


def _class_problem(found: Value, name: str) -> tuple[str, str | None] | None:
    expected = _WORDS[name]
    if isinstance(found, InterfaceClass):
        if isinstance(found.definition, CLASSES[name]):
            return None
        return f"the class {found.definition.name} where {expected} is expected", None
    if isinstance(found, Message):
        last = found.name.rpartition("/")[2]
        return f"a message where the class of {expected} is expected", f"write {last} without '()'"
    if kind_of(found) is not None or isinstance(found, OwnMethod | ModuleFunction):
        return f"{_shown(found)} where the class of {expected} is expected", None
    return None


def _function_problem(node: ast.expr, found: Value) -> tuple[str, str | None] | None:
    if isinstance(node, ast.Call) and (found is NONE or isinstance(found, Pending)):
        name = ast.unparse(node.func)
        return "the function is called here, not passed", f"write {name} without '()'"
    if found is not NONE and kind_of(found) not in (None, "function"):
        return f"{_shown(found)} where a function is expected", None
    return None


def _shown(found: Value) -> str:
    if isinstance(found, OwnMethod | ModuleFunction | ApiMethod):
        return "a function"
    return shown(found)


def _signature_problems(call: ast.Call, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the callbacks that do not accept the arguments that rclpy calls them with."""
    for callback in callbacks_of(call, scope):
        count = len(callback.handler.arguments)
        match scope.type_of(callback.node), callback.node:
            case OwnMethod(method=method, home=home), _ if method.node is not None:
                signature = signature_of(method.node, is_bound=True) if method.known else None
                wrong = signature is not None and not signature.accepts(count)
                if wrong and callback.gets_info and _takes_info(method.node):
                    continue
                if wrong and method.node is not None:
                    span = name_span(method.node, "def", home.source)
                    yield _signature_problem(method.node, callback, span)
            case ModuleFunction(node=function, home=home, is_bound=is_bound), _:
                signature = signature_of(function, is_bound=is_bound)
                if signature is not None and not signature.accepts(count):
                    yield _signature_problem(
                        function, callback, name_span(function, "def", home.source)
                    )
            case _, ast.Lambda(args=arguments) as function:
                least = len(arguments.args) - len(arguments.defaults)
                if callback.gets_info and least == count + 1:
                    continue
                most = len(arguments.args) if arguments.vararg is None else count
                if not least <= count <= most:
                    span = span_of(function, scope.home.source)
                    yield CodeProblem(
                        Kind.SIGNATURE,
                        f"this function is called with {_counted(count)}",
                        span,
                    )


def _takes_info(function: Function) -> bool:
    """Return whether the argument after the message may be a dict."""
    arguments = function.args.args[1:]
    if len(arguments) != _WITH_INFO:
        return False
    annotation = arguments[-1].annotation
    return annotation is None or ast.unparse(annotation).startswith(("Any", "dict", "Dict", "Mess"))


def transition_problems(types: HostedTypes) -> Iterator[CodeProblem]:
    """Yield the transition handlers that do not accept the state."""
    for home, known in types.source.own_classes:
        for method in known.methods:
            if not types.is_transition(method.name) or method.node is None or method.accepts(1):
                continue
            takes = _takes(method.node)
            message = f"'{method.name}' is called with the state, but takes {takes}"
            hint = f"write 'def {method.name}(self, state)'"
            span = name_span(method.node, "def", home.source)
            yield CodeProblem(Kind.SIGNATURE, message, span, hint)


def _signature_problem(function: Function, callback: Callback, span: Span) -> CodeProblem:
    count = len(callback.handler.arguments)
    message = (
        f"'{function.name}' is called with {_counted(count)} as '{callback.parameter}', but takes"
        f" {_takes(function)}"
    )
    lines = (function.lineno, function.end_lineno or function.lineno)
    return CodeProblem(Kind.SIGNATURE, message, span, lines=lines)


def _takes(function: Function) -> str:
    names = [item.arg for item in (*function.args.posonlyargs, *function.args.args)]
    return f"({', '.join(names)})"


def _counted(count: int) -> str:
    if count == 0:
        return "no argument"
    return "1 argument" if count == 1 else f"{count} arguments"
