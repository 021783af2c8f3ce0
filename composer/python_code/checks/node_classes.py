"""Classes derived from rclpy's Node: their parameters, constructors and transitions."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.base.diagnostics import nearest
from composer.python_code.checks.scopes import Code, NodeScope
from composer.python_code.lookup import imported_from, is_of_rclpy
from composer.python_code.nodes import (
    UNDECLARED,
    calls_on_self,
    declared_parameters,
    passes_node_on,
)
from composer.python_code.problems import Family, Problem
from composer.python_code.trees import argument, called_name, catches, dotted, span_of, walk

#: The parameters that every node has.
_DECLARED = frozenset({"use_sim_time", "start_type_description_service"})
_READING = frozenset({"describe_parameter", "get_parameter", "get_parameter_type"})
_ERRORS = frozenset({"Exception", "ParameterException", "ParameterNotDeclaredException"})
_TRANSITIONS = frozenset({"activate", "cleanup", "configure", "deactivate", "error", "shutdown"})


def node_class_problems(code: Code) -> Iterator[Problem]:
    """Yield what is wrong about a class that is derived from rclpy's Node."""
    yield from _missing_calls(code)
    if code.source.method("get_parameter") or code.source.method("declare_parameter"):
        return  # they may do something else
    yield from _undeclared(code)
    for scope in code.scopes:
        yield from _incomplete_profiles(scope)


def _undeclared(code: Code) -> Iterator[Problem]:
    """Yield the parameters that methods read, but that no file declares."""
    parameters = declared_parameters(code.source)
    hosted = code.node.hosted_class
    given = {name.value for name, _ in hosted.arguments} if hosted is not None else set()
    if not parameters.is_complete or not UNDECLARED.isdisjoint(given):
        return
    if any(map(_has_other_options, code.scopes)):
        return
    declared = _DECLARED | parameters.types.keys()
    is_shared = passes_node_on(code.source)
    own = {module.source for module in code.source.own_modules}
    for scope, call, method in calls_on_self(code.source):
        name = argument(call, 0, "name") if method in _READING and scope.source in own else None
        read = scope.known(scope.text, name)
        if name is None or read is None or read in declared or read.startswith("qos_overrides."):
            continue
        close = nearest(read, declared)
        is_caught = any(
            isinstance(x, ast.ExceptHandler) and catches(x, _ERRORS) for x in scope.nodes
        )
        if (close or not is_shared) and not is_caught:
            hint = f"did you mean '{close}'?" if close else f"call declare_parameter('{read}')"
            message = f"the class does not declare the parameter '{read}'"
            yield Problem(Family.PARAMETER, message, span_of(name, scope.source), hint)


def _has_other_options(scope: NodeScope) -> bool:
    """Return whether a constructor gets options from elsewhere than from the node's arguments."""
    own = scope.function.args.kwarg if scope.function is not None else None
    passed_on = own.arg if own is not None else None
    calls = (x for x in scope.nodes if isinstance(x, ast.Call) and called_name(x) == "__init__")
    options = (item for call in calls for item in call.keywords if item.arg is None)
    return any(dotted(item.value) != passed_on for item in options)


def _incomplete_profiles(scope: NodeScope) -> Iterator[Problem]:
    """Yield the QoS profiles without history and depth, which rclpy refuses."""
    for node in scope.nodes:
        match node:
            case ast.Call(args=[], keywords=keywords):
                is_profile = scope.full_name(node.func) == "rclpy.qos.QoSProfile"
                if is_profile and {"depth", "history", None}.isdisjoint(x.arg for x in keywords):
                    message = "a QoSProfile needs its depth or its history"
                    yield scope.problem(Family.ARGUMENTS, message, node, "add 'depth=10'")


def _missing_calls(code: Code) -> Iterator[Problem]:
    """Yield the methods that do not call the base class's method, and wrong transitions."""
    has_publishers = any(
        isinstance(node, ast.Attribute) and node.attr == "create_lifecycle_publisher"
        for scope in code.scopes
        for node in scope.nodes
    )
    for module, class_ in code.source.own_classes:
        origin = imported_from(module, class_.bases[0]) if len(class_.bases) == 1 else None
        if origin is None or not is_of_rclpy(origin):
            continue
        for method in class_.methods:
            transition = method.name.removeprefix("on_")
            if not method.known or method.node is None:
                continue
            if method.name == "__init__" and not _calls_base(class_.node, "__init__"):
                message = f"the constructor of '{class_.name}' does not call that of {origin.name}"
                hint = "begin with super().__init__('name_of_the_node')"
                yield Problem(Family.CONSTRUCTOR, message, method.span, hint)
            if origin.name != "LifecycleNode" or transition not in _TRANSITIONS:
                continue
            if not method.accepts(1):
                takes = ", ".join(("self", *method.arguments))
                message = f"'{method.name}' is called with the state, but takes ({takes})"
                hint = f"write 'def {method.name}(self, state)'"
                yield Problem(Family.SIGNATURE, message, method.span, hint)
            is_switch = transition in ("activate", "deactivate")
            if is_switch and has_publishers and not _calls_base(method.node, method.name):
                message = f"'{method.name}' does not {transition} the lifecycle publishers"
                hint = f"end it with 'return super().{method.name}(state)'"
                values = [
                    x.value for x in method.node.body if isinstance(x, ast.Return) and x.value
                ]
                span = span_of(values[-1], module.source) if values else method.span
                yield Problem(Family.CONSTRUCTOR, message, span, hint, is_certain=False)


def _calls_base(node: ast.AST, name: str) -> bool:
    """Return whether code may call a method ``name`` of another class."""
    return any(isinstance(x, ast.Attribute) and x.attr in (name, "__new__") for x in walk([node]))
