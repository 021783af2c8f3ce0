"""Checks of classes derived from rclpy's Node: their constructors and parameters."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import BehaviorSource, Class, Function, Module
from composer.behavior_source.method_body import argument, dotted
from composer.behavior_source.spans import span_of
from composer.behavior_source.syntax import name_span
from composer.behavior_source.traversal import walk
from composer.behavior_types.hosted import HostedTypes
from composer.behavior_types.libraries.rclpy_api import rclpy_class
from composer.behavior_types.syntax.names import own_name
from composer.diagnostics import nearest

_DECLARED = frozenset({"use_sim_time", "start_type_description_service"})
_READING = frozenset(
    {"describe_parameter", "get_parameter", "get_parameter_type", "set_descriptor"}
)
_DECLARING = frozenset({"declare_parameter", "declare_parameters"})
#: With one of these, parameters exist that the class does not declare by name.
_UNDECLARED = frozenset(
    {"allow_undeclared_parameters", "automatically_declare_parameters_from_overrides"}
)


def missing_constructors(types: HostedTypes) -> Iterator[CodeProblem]:
    """Yield the constructors that do not call that of Node."""
    for home, known in types.source.own_classes:
        bases = known.node.bases
        if len(bases) != 1 or rclpy_class(own_name(bases[0], home)) is None:
            continue
        constructor = _constructor(known)
        if constructor is None or _calls_constructor(constructor):
            continue
        name = own_name(bases[0], home).rpartition(".")[2]
        message = f"the constructor of '{known.name}' does not call that of {name}"
        span = name_span(constructor, "def", home.source)
        hint = "begin with super().__init__('name_of_the_node')"
        yield CodeProblem(Kind.CONSTRUCTOR, message, span, hint)


def _constructor(known: Class) -> Function | None:
    found = (method.node for method in known.methods if method.name == "__init__")
    return next(found, None)


def _calls_constructor(function: Function) -> bool:
    return any(
        isinstance(node, ast.Attribute) and node.attr in {"__init__", "__new__"}
        for node in walk(function.body)
    )


def undeclared_parameters(types: HostedTypes) -> Iterator[CodeProblem]:
    """Yield the parameters that a class reads, but does not declare.

    Nothing is reported if a parameter is declared under a computed name, if other code may declare
    it, or if the class handles the error.
    """
    if not types.source.complete or not types.bases:
        return
    declared = declared_names(types.source)
    reads: list[tuple[str, ast.expr, Module]] = []
    for home in types.source.own_modules if declared is not None else ():
        for node in walk(home.tree.body):
            if isinstance(node, ast.ExceptHandler) and _is_of_parameters(node):
                return
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
                continue
            name = node.func.attr
            if name in {"has_parameter", "get_parameters_by_prefix"}:
                return
            if name in _READING and node.args and _is_self(node.func.value):
                first = node.args[0]
                if isinstance(first, ast.Constant) and isinstance(first.value, str):
                    reads.append((first.value, first, home))
    for name, where, home in reads:
        if declared is None or is_declared(name, declared):
            continue
        close = nearest(name, declared)
        if close is None and types.self_escapes:
            continue
        hint = f"did you mean '{close}'?" if close else f"declare it: declare_parameter('{name}')"
        message = f"the class does not declare the parameter '{name}'"
        yield CodeProblem(Kind.PARAMETER, message, span_of(where, home.source), hint)


def declared_names(source: BehaviorSource) -> set[str] | None:
    """Return the names of the parameters that a class declares; None if it may have others."""
    declared: set[str] = set()
    calls = mentions = 0
    for home in source.own_modules:
        for node in walk(home.tree.body):
            if isinstance(node, ast.keyword) and node.arg in _UNDECLARED:
                return None
            mentions += isinstance(node, ast.Attribute) and node.attr in _DECLARING
            match node:
                case ast.Call(func=ast.Attribute(attr=name)) if name in _DECLARING:
                    calls += 1
                    found = _declared_by(node)
                    if found is None:
                        return None
                    declared |= found
    # or else the method is passed on, or has another name
    return declared if mentions == calls else None


def is_declared(name: str, declared: set[str]) -> bool:
    """Return whether a class has a parameter: one of these, or one of every node."""
    return name in declared | _DECLARED or name.startswith("qos_overrides.")


def _is_of_parameters(handler: ast.ExceptHandler) -> bool:
    caught = ast.walk(handler.type) if handler.type is not None else ()
    names = {dotted(item) for item in caught if isinstance(item, ast.Name | ast.Attribute)}
    return any(name.endswith("ParameterNotDeclaredException") for name in names)


def _is_self(node: ast.expr) -> bool:
    return dotted(node) == "self"


def _declared_by(call: ast.Call) -> set[str] | None:
    """Return the names that a call declares, None if they are not known."""
    if isinstance(call.func, ast.Attribute) and call.func.attr == "declare_parameter":
        name = _text(argument(call, 0, "name"))
        return {name} if name is not None else None
    namespace = _text(argument(call, 0, "namespace"))
    listed = argument(call, 1, "parameters")
    if namespace is None or not isinstance(listed, ast.List | ast.Tuple):
        return None
    names: set[str] = set()
    for item in listed.elts:
        name = _text(item.elts[0]) if isinstance(item, ast.Tuple) and item.elts else None
        if name is None:
            return None
        names.add(f"{namespace}.{name}" if namespace else name)
    return names


def _text(node: ast.expr | None) -> str | None:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    return None
