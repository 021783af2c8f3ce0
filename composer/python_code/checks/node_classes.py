"""Classes derived from rclpy's Node: their parameters, constructors and transitions."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence

from composer.diagnostics import nearest
from composer.python_code.checks.scopes import Code, Constant, Scope
from composer.python_code.problems import Family, Problem
from composer.python_code.source import imported_from
from composer.python_code.source.flow import returned_values, returns_nothing
from composer.python_code.source.method_body import argument, catches, dotted
from composer.python_code.source.traversal import walk

#: The parameters that every node has.
_DECLARED = frozenset({"use_sim_time", "start_type_description_service"})
_READING = frozenset({"describe_parameter", "get_parameter", "get_parameter_type"})
_DECLARING = frozenset({"declare_parameter", "declare_parameters"})
#: With one of these, a class may have parameters that it does not declare by name.
_UNDECLARED = frozenset(
    {"allow_undeclared_parameters", "automatically_declare_parameters_from_overrides"}
)
_ASKING = frozenset({"get_parameters_by_prefix", "has_parameter"})
_ERRORS = frozenset({"Exception", "ParameterException", "ParameterNotDeclaredException"})
#: Packages that get the node, but declare no parameters that the class reads.
_OF_ROS = ("message_filters.", "rclpy.", "super", "tf2_ros.")
_FIELDS = {bool: "bool_value", int: "integer_value", float: "double_value", str: "string_value"}
_TRANSITIONS = frozenset({"activate", "cleanup", "configure", "deactivate", "error", "shutdown"})


def node_class_problems(code: Code) -> Iterator[Problem]:
    """Yield what is wrong about a class that is derived from rclpy's Node."""
    yield from _missing_calls(code)
    if code.source.method("get_parameter") or code.source.method("declare_parameter"):
        return  # they may do something else
    yield from _undeclared(code)
    types = _parameter_types(code)
    for scope in code.scopes:
        for node in scope.nodes if scope.method is not None else ():
            for value in _values_used(node):
                if _is_parameter(value, scope):
                    message = "this is a Parameter, not its value"
                    yield scope.problem(Family.TYPE, message, value, "add .value")
            if isinstance(node, ast.Attribute) and node.attr in _FIELDS.values():
                yield from _wrong_field(node, types, scope)


def _undeclared(code: Code) -> Iterator[Problem]:
    """Yield the parameters that methods read, but that no file declares."""
    calls = [
        (scope, node, getattr(node.func, "attr", ""))
        for scope in code.scopes
        for node in scope.nodes
        if isinstance(node, ast.Call)
    ]
    declared = _declared_names(code, calls) if code.source.complete else None
    if declared is None:
        return
    guarded = {
        id(scope)
        for scope in code.scopes
        if any(isinstance(x, ast.ExceptHandler) and catches(x, _ERRORS) for x in scope.nodes)
    }
    is_shared = any(_is_passed_on(call, scope) for scope, call, _ in calls)
    for scope, call, name in calls:
        is_read = name in _READING and dotted(call.func) == f"self.{name}" and call.args
        read = scope.constant(call.args[0]) if is_read and scope.method is not None else None
        if not isinstance(read, str) or read in declared or read.startswith("qos_overrides."):
            continue
        close = nearest(read, declared)
        if id(scope) not in guarded and (close or not is_shared):
            hint = f"did you mean '{close}'?" if close else f"call declare_parameter('{read}')"
            message = f"the class does not declare the parameter '{read}'"
            yield scope.problem(Family.PARAMETER, message, call.args[0], hint)


def _declared_names(
    code: Code, calls: Sequence[tuple[Scope, ast.Call, str]]
) -> frozenset[str] | None:
    """Return the parameters that a class has, None if it may have others."""
    declared: list[str | None] = [*_DECLARED]
    mentions = 0
    for scope in code.scopes:
        for node in scope.nodes:
            if isinstance(node, ast.keyword) and node.arg in _UNDECLARED:
                return None
            mentions += isinstance(node, ast.Attribute) and node.attr in _DECLARING
    for scope, call, name in calls:
        if name in _ASKING or (name == "__init__" and any(x.arg is None for x in call.keywords)):
            return None
        if name in _DECLARING:
            mentions -= 1
            declared += _names(call, scope)
    # With mentions left, the method is passed on or has another name.
    return None if mentions or None in declared else frozenset(filter(None, declared))


def _is_passed_on(call: ast.Call, scope: Scope) -> bool:
    """Return whether code that may declare parameters gets the node."""
    given = [*call.args, *(item.value for item in call.keywords)]
    is_given = any(isinstance(item, ast.Name) and item.id == "self" for item in given)
    return is_given and not scope.full_name(call.func).startswith(_OF_ROS)


def _names(call: ast.Call, scope: Scope) -> list[str | None]:
    """Return the names that a call declares, None for one that only running the code shows."""
    first = scope.constant(argument(call, 0, "name") or argument(call, 0, "namespace"))
    if not isinstance(first, str):
        return [None]
    if dotted(call.func).endswith("declare_parameter"):
        return [first]
    listed = argument(call, 1, "parameters")
    items = listed.elts if isinstance(listed, ast.List | ast.Tuple) else [listed]
    names = [
        scope.constant(item.elts[0]) if isinstance(item, ast.Tuple) and item.elts else None
        for item in items
    ]
    prefix = f"{first}." if first else ""
    return [f"{prefix}{name}" if isinstance(name, str) else None for name in names]


def _values_used(node: ast.AST) -> Sequence[ast.expr]:
    """Return what a condition or a format takes the value of; other uses raise an error."""
    match node:
        case ast.Compare(left=left, ops=[ast.Eq() | ast.NotEq()], comparators=[right]):
            return (left, right)
        case ast.If(test=value) | ast.While(test=value) | ast.UnaryOp(op=ast.Not(), operand=value):
            return (value,)
        case ast.FormattedValue(value=value, format_spec=ast.JoinedStr()):
            return (value,)
    return ()


def _is_parameter(node: ast.expr, scope: Scope) -> bool:
    value = scope.value(node.id) if isinstance(node, ast.Name) else node
    return isinstance(value, ast.Call) and dotted(value.func) == "self.get_parameter"


def _parameter_types(code: Code) -> Mapping[Constant, type[object]]:
    """Return the types of the parameters that are declared once, with a constant default."""
    types: dict[Constant, list[type[object]]] = {}
    for scope in code.scopes:
        for node in scope.nodes:
            match node:
                case ast.Call(func=ast.Attribute(attr="declare_parameter"), args=[name, *rest]):
                    default = scope.constant(rest[0]) if len(rest) == 1 else None
                    types.setdefault(scope.constant(name), []).append(type(default))
    return {name: kinds[0] for name, kinds in types.items() if len(kinds) == 1}


def _wrong_field(
    node: ast.Attribute, types: Mapping[Constant, type[object]], scope: Scope
) -> Iterator[Problem]:
    """Yield that a field of a parameter's value is read that the type of the parameter unsets."""
    match node.value:
        case ast.Call(
            func=ast.Attribute(value=ast.Call(args=[name]) as read, attr="get_parameter_value")
        ) if _is_parameter(read, scope):
            expected = _FIELDS.get(types.get(scope.constant(name), object))
            if expected is not None and expected != node.attr:
                message = f"the '{node.attr}' of this parameter is never set"
                yield scope.problem(Family.TYPE, message, node, f"did you mean '{expected}'?")


def _missing_calls(code: Code) -> Iterator[Problem]:
    """Yield the methods that do not call those of their base class, and wrong transitions."""
    has_publishers = any(
        isinstance(node, ast.Attribute) and node.attr == "create_lifecycle_publisher"
        for scope in code.scopes
        for node in scope.nodes
    )
    for module, class_ in code.source.own_classes:
        origin = imported_from(module, class_.bases[0]) if len(class_.bases) == 1 else None
        if origin is None or origin.module.partition(".")[0] != "rclpy":
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
            values = returned_values(method.node)
            is_bool = any(isinstance(x, ast.Constant) and x.value in (True, False) for x in values)
            if is_bool or returns_nothing(method.node):
                message = f"'{method.name}' must return a TransitionCallbackReturn"
                hint = "write 'return TransitionCallbackReturn.SUCCESS'"
                yield Problem(Family.RETURN, message, method.span, hint)
            is_switch = transition in ("activate", "deactivate")
            if is_switch and has_publishers and not _calls_base(method.node, method.name):
                message = f"'{method.name}' does not {transition} the lifecycle publishers"
                hint = f"end it with 'return super().{method.name}(state)'"
                yield Problem(Family.CONSTRUCTOR, message, method.span, hint, is_certain=False)


def _calls_base(node: ast.AST, name: str) -> bool:
    """Return whether code may call a method ``name`` of another class."""
    return any(isinstance(x, ast.Attribute) and x.attr in (name, "__new__") for x in walk([node]))
