"""Uses of the API of behaviors: too early, or with unknown keys."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.base.diagnostics import suggestion
from composer.interfaces.field_types.types import STATUS, Word
from composer.python_code.checks.scopes import Code, NodeScope
from composer.python_code.nodes import array_length, published_port, reached_methods
from composer.python_code.problems import Family, Problem
from composer.python_code.stubs.behaviors import PORT_ATTRIBUTES
from composer.python_code.syntax import Method
from composer.python_code.trees import SCOPES, dotted, span_of, walk

#: The attributes that the composer sets after the constructor.
_SET_LATER = frozenset(
    {"clock", "fail", "log", "node", "parameters", "transforms", *PORT_ATTRIBUTES}
)


def behavior_problems(code: Code) -> Iterator[Problem]:
    """Yield the wrong uses of the API in a behavior."""
    yield from _early_attributes(code)
    for name in ("on_configure", "on_cleanup"):
        method = code.source.method(name)
        for reached in reached_methods(code.source, method) if method is not None else ():
            yield from _early_calls(name, reached, code)
    for scope in code.scopes:
        for node in scope.nodes:
            match node:
                case ast.Subscript(value=ast.Attribute() as owner, slice=index):
                    yield from _key(dotted(owner), index, scope)
                case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Attribute() as value):
                    yield from _unpacked(names, value, scope)
                case ast.Compare(left=left, ops=[ast.Eq() | ast.NotEq()], comparators=[right]):
                    word = _word(left, scope)
                    problem = word.problem(scope.constant(right)) if word is not None else None
                    if problem is not None:
                        yield scope.doubt(problem[0], right, problem[1])


def _early_attributes(code: Code) -> Iterator[Problem]:
    """Yield what a constructor reads although the composer sets it later."""
    constructor = code.source.method("__init__")
    names = _SET_LATER - code.assigned - {method.name for method in code.source.methods}
    for method in reached_methods(code.source, constructor) if constructor is not None else ():
        nodes = list(walk(method.node.body if method.node else [], closed=SCOPES))
        # A class may be used without the composer, and ask for what is there.
        if any(isinstance(x, ast.Try) or getattr(x, "id", "") == "hasattr" for x in nodes):
            continue
        for node in nodes:
            match node:
                case ast.Attribute(value=ast.Name(id="self"), attr=name) if name in names:
                    message = f"'self.{name}' is not set in the constructor"
                    span = span_of(node, method.span.file)
                    yield Problem(Family.EARLY, message, span, "move this to on_configure")
                    return  # the others have the same cause


def _early_calls(handler: str, method: Method, code: Code) -> Iterator[Problem]:
    """Yield what a method sends, called by a handler while the node is not active."""
    nodes = walk([method.node] if method.node is not None else [])
    if any(isinstance(node, ast.Try | ast.If) for node in nodes):
        return  # it may know
    for call in method.calls:
        group, _, rest = call.name.removeprefix("self.").partition(".")
        port = code.node.port(rest.partition(".")[0]) if group in PORT_ATTRIBUTES else None
        if port is None or port.always_on or call.deferred:
            continue
        message = f"'{handler}' runs while the node is not active: "
        hint = "move it to on_activate"
        if published_port(call.name) is not None:
            message += "the message is dropped"
            yield Problem(Family.EARLY, message, call.span, hint, is_certain=False)
        elif call.name.endswith((".call", ".send_goal")):
            message += "this raises CallCancelled"
            yield Problem(Family.EARLY, message, call.span, hint)


def _key(owner: str, index: ast.expr, scope: NodeScope) -> Iterator[Problem]:
    """Yield the constant keys of ports and parameters that the node does not have."""
    node, key = scope.code.node, scope.constant(index)
    section = owner.removeprefix("self.") if scope.method is not None and node.complete else ""
    kind, names = "parameter", [item.name.value for item in node.parameters]
    if section in PORT_ATTRIBUTES:
        kind = PORT_ATTRIBUTES[section].value
        names = [item.name.value for item in node.ports_of(PORT_ATTRIBUTES[section])]
    elif owner != "self.parameters":
        return
    if isinstance(key, str) and key not in names:
        message = f"the node has no {kind} '{key}'"
        yield scope.problem(Family.PORT, message, index, suggestion(key, names))


def _unpacked(names: list[ast.expr], array: ast.expr, scope: NodeScope) -> Iterator[Problem]:
    """Yield the array parameters that are assigned to more or fewer names than they have."""
    owner, _, name = dotted(array).rpartition(".")
    is_own = owner == "self.parameters" and scope.method is not None
    parameter = scope.code.node.parameter(name) if is_own else None
    size = None if parameter is None else array_length(parameter)
    if size is None or any(isinstance(node, ast.Try) or _is_len(node) for node in scope.nodes):
        return  # the code may know
    is_open = any(isinstance(item, ast.Starred) for item in names)
    if size < len(names) - 1 if is_open else size != len(names):
        elements = f"{size} element" + ("" if size == 1 else "s")
        message = f"parameter '{name}' of node '{scope.code.node.name}' has {elements}"
        hint = "change its value, or the code"
        yield scope.problem(Family.INDEX, f"{message}, not {len(names)}", array, hint)


def _is_len(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id == "len"


def _word(node: ast.expr, scope: NodeScope) -> Word | None:
    """Return the type of a parameter with choices, or of the status of a goal."""
    match node:
        case ast.Attribute(value=ast.Attribute(value=ast.Name(id="self"), attr="parameters")):
            parameter = scope.code.node.parameter(node.attr)
            if parameter is not None and parameter.choices is not None:
                return Word("string", words=tuple(map(str, parameter.choices.value)))
        case ast.Attribute(value=ast.Name(id=name), attr="status"):
            match scope.value(name):
                case ast.Await(value=ast.Call(func=ast.Attribute(attr="result"))):
                    return STATUS
    return None
