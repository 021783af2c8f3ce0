"""Copies of Python files in which classes know their surroundings.

In a copy, a behavior derives from the generated base class of its node type, and handlers and
callbacks of rclpy know the types of their arguments. All that is added to a copy has lines of its
own, so the columns of what a user wrote stay as they are.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from pathlib import Path
from typing import TypeGuard

from composer.base.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.model import Node, PortKind
from composer.python_code.lookup import imported_from
from composer.python_code.nodes import Signature
from composer.python_code.stubs.behaviors import interface_modules, port_type, signatures
from composer.python_code.syntax import Method, Module
from composer.python_code.trees import (
    Function,
    argument,
    bindings,
    called_name,
    characters,
    dotted,
    is_none,
    last_name,
    positional_arguments,
)

#: The line that a copy gets, so that annotations can name what they need.
_IMPORTS = (
    "import composer.behavior, composer.typed, rclpy.action, rclpy.lifecycle, "
    "rclpy.parameter, rclpy.task, typing"
)
_HANDLE = "rclpy.action.server.ServerGoalHandle[{0}.Goal, {0}.Result, {0}.Feedback]"
_SENT_GOAL = "rclpy.action.client.ClientGoalHandle[{0}.Goal, {0}.Result, {0}.Feedback]"
#: The callbacks of an action server, with their position.
_OF_ACTION_SERVERS = {
    "execute_callback": (3, Signature((("goal_handle", _HANDLE),), "{0}.Result")),
    "goal_callback": (None, Signature((("goal_request", "{0}.Goal"),), "")),
    "cancel_callback": (None, Signature((("goal_handle", _HANDLE),), "")),
    "handle_accepted_callback": (None, Signature((("goal_handle", _HANDLE),), "")),
}
_OF_SUBSCRIPTIONS = Signature((("message", "{0}"),), "")
_OF_SERVICES = Signature((("request", "{0}.Request"), ("response", "{0}.Response")), "{0}.Response")
TRANSITIONS = ("activate", "cleanup", "configure", "deactivate", "error", "shutdown")
_TRANSITION = Signature(
    (("state", "rclpy.lifecycle.LifecycleState"),), "rclpy.lifecycle.TransitionCallbackReturn"
)
_OF_PARAMETERS = Signature((("parameters", "list[{0}]"),), "rcl_interfaces.msg.SetParametersResult")
_FEEDBACK = Signature((("feedback", "{0}.Feedback"),), "")
_FEEDBACK_MESSAGE = Signature(
    (("feedback_message", "rclpy.action.client._FeedbackMessage[{0}.Feedback]"),), ""
)
#: The methods that return futures.
_FUTURES = {
    "call_async": "rclpy.task.Future[{0}.Response]",
    "send_goal_async": f"rclpy.task.Future[{_SENT_GOAL}]",
    "get_result_async": "rclpy.task.Future[rclpy.action.client._GetResultResponse[{0}.Result]]",
}


@dataclass(slots=True)
class Copy:
    """The text of a copy, and which of its lines the original file does not have."""

    module: Module
    text: str
    added: frozenset[int]

    def is_added(self, line: int, column: int) -> bool:
        """Return whether the original lacks what is at a place: a line, or a result at its end."""
        return line in self.added or column > len(self.module.source.line(self.line(line))) + 1

    def line(self, number: int) -> int:
        """Return the line of the original that is at a line of the copy."""
        return max(number - sum(added <= number for added in self.added), 1)


def edited_copy(
    module: Module,
    user: Node,
    nodes: Mapping[tuple[Path | None, str], tuple[Node, str]],
    interfaces: Interfaces,
) -> Copy:
    """Return the copy of a file for the checker.

    ``user`` is a node that uses the file; ``nodes`` has the nodes of classes with their bases.
    """
    edits = _Edits(module.source.text.split("\n"))
    names: set[str] = set()
    for class_ in module.classes.values():
        edits.remove_unset_attributes(class_.node, stays_none=user.behavior is not None)
        node, base = nodes.get((module.path, class_.name), (None, ""))
        if base and base not in {name.rpartition(".")[2] for name in class_.bases}:
            edits.add_base(class_.node, f"composer.typed.{base}")
        known = callback_signatures(class_.node, module, node, interfaces)
        for method in class_.methods:
            signature = known.get(method.name)
            if signature is not None and method.node is not None:
                edits.annotate(method, method.node, signature)
                types = [signature.result, *(type_ for _, type_ in signature.arguments)]
                names.update(interface_modules(" ".join(types)))
    imports = (item for item in module.tree.body if isinstance(item, ast.ImportFrom))
    first = [item.end_lineno or 0 for item in imports if item.module == "__future__"]
    edits.added.append((max(first, default=0), ", ".join((_IMPORTS, *sorted(names)))))
    return edits.copy(module)


@dataclass(slots=True)
class _Edits:
    """The lines of a copy, and the lines to add after a number of lines."""

    lines: list[str]
    added: list[tuple[int, str]] = field(default_factory=list)

    def copy(self, module: Module) -> Copy:
        """Return the copy with all lines."""
        numbers = set()
        for count, (after, text) in enumerate(sorted(self.added)):
            self.lines.insert(after + count, text)
            numbers.add(after + count + 1)
        return Copy(module, "\n".join(self.lines), frozenset(numbers))

    def remove_unset_attributes(self, node: ast.ClassDef, *, stays_none: bool) -> None:
        """Remove ``self.last = None`` from the constructor if another method sets a value.

        Otherwise the checker takes None as the type of the attribute, whatever the others set. If
        ``stays_none``, a method of its own says that the value may be None.
        """
        unset = [item for item in _constructor(node) if _is_unset(item, bindings(node))]
        for item in unset:
            line = self.lines[item.lineno - 1]
            start, end = item.col_offset, item.end_col_offset or item.col_offset
            self.lines[item.lineno - 1] = line[:start] + "pass".ljust(end - start) + line[end:]
        if unset and stays_none:
            indentation = " " * node.body[0].col_offset
            statements = "; ".join(f"{ast.unparse(item.targets[0])} = none" for item in unset)
            method = f"{indentation}def _composer_unset(self, none: None): {statements}"
            self.added.append((node.end_lineno or node.lineno, method))

    def add_base(self, node: ast.ClassDef, base: str) -> None:
        """Add the first base class of a class; its other bases follow in a line of their own."""
        line = self.lines[node.lineno - 1]
        named = re.search(rf"\bclass\s+{node.name}\b\s*(?:\[.*?\]\s*)?(\()?", line)
        if named is not None and named[1]:
            self.added.append((node.lineno - 1, f"{line[: named.end()]}{base},"))
            self.lines[node.lineno - 1] = " " * named.end() + line[named.end() :]
        elif named is not None:
            self.lines[node.lineno - 1] = f"{line[: named.end()]}({base}){line[named.end() :]}"

    def annotate(self, method: Method, node: Function, signature: Signature) -> None:
        """Give the arguments of a method their types where its body begins, and its result."""
        first = node.body[0]
        number = min(x.lineno for x in (first, *getattr(first, "decorator_list", ())))
        before, line = self.lines[number - 2], self.lines[number - 1]
        indentation = line[: first.col_offset]
        if indentation.strip() or before.endswith("\\"):
            return  # the body is in the line of the signature
        given = [item for item in positional_arguments(node) if item.arg in method.arguments]
        pairs = zip(given, signature.arguments, strict=False)
        known = [
            f"{item.arg} = typing.cast({type_!r}, {item.arg})"
            for item, (_, type_) in pairs
            if type_ and (item.annotation is None or "[" in type_)  # as ServerGoalHandle lacks it
        ]
        if known:
            self.added.append((number - 1, indentation + "; ".join(known)))
        if signature.result not in ("", "None"):
            self._annotate_result(node, signature.result)

    def _annotate_result(self, function: Function, result: str) -> None:
        if function.returns is None:
            for number in range(function.body[0].lineno - 1, function.lineno - 1, -1):
                line = self.lines[number - 1]
                closing = re.match(r"[^#]*\)(?=\s*:\s*(#.*)?$)", line)
                if closing is not None:
                    end = closing.end()
                    self.lines[number - 1] = f"{line[:end]} -> {result}{line[end:]}"
                    return
        elif is_none(function.returns):  # by habit
            number, line = function.returns.lineno, self.lines[function.returns.lineno - 1]
            start = characters(line, function.returns.col_offset)
            self.lines[number - 1] = f"{line[:start]}{result}{line[start + 4 :]}"


def _constructor(node: ast.ClassDef) -> list[ast.stmt]:
    """Return the statements of the constructor of a class."""
    found = (item for item in node.body if getattr(item, "name", "") == "__init__")
    return next((item.body for item in found if isinstance(item, ast.FunctionDef)), [])


def _is_unset(
    statement: ast.stmt, values: Mapping[str, list[ast.expr | None]]
) -> TypeGuard[ast.Assign]:
    """Return whether a statement is ``self.name = None``, and others set a value."""
    match statement:
        case ast.Assign(targets=[ast.Attribute() as target], value=ast.Constant(value=None)):
            others = filter(None, values.get(dotted(target), ()))
            return statement.end_lineno == statement.lineno and not all(map(is_none, others))
    return False


def callback_signatures(
    class_: ast.ClassDef, module: Module, node: Node | None, interfaces: Interfaces
) -> dict[str, Signature]:
    """Return the methods of a class that the composer or rclpy calls, with their arguments.

    ``node`` is the node of the class, if it has one. A method that is passed as a callback of
    several types is left out. A callback of a client or future has a known type if the class has
    clients of one service, or of one action, only.
    """
    found: dict[str, set[Signature]] = {}
    named = [(called_name(item), item) for item in ast.walk(class_) if isinstance(item, ast.Call)]
    actions = (argument(call, 1, "action_type") for name, call in named if name == "ActionClient")
    services = (argument(call, 0, "srv_type") for name, call in named if name == "create_client")
    action, service = (_only(_type(x, module) for x in types) for types in (actions, services))
    clients = {"send_goal_async": action, "get_result_async": action, "call_async": service}
    for port in node.ports_of(PortKind.ACTION_CLIENT) if node is not None else ():
        clients[f"self.action_clients.{port.name}"] = port_type(port, interfaces) or ""
    for function in (item for item in class_.body if isinstance(item, Function)):
        values = {**bindings(class_), **bindings(function)}
        for call in (item for item in ast.walk(function) if isinstance(item, ast.Call)):
            for name, signature in _of_call(call, values, module, clients):
                found.setdefault(name, set()).add(signature)
    origins = [imported_from(module, dotted(base)) for base in class_.bases]
    if any(origin is not None and origin.name == "LifecycleNode" for origin in origins):
        found |= {f"on_{name}": {_TRANSITION} for name in TRANSITIONS}
    known = {name: items.pop() for name, items in found.items() if len(items) == 1}
    if node is not None and node.behavior is not None:
        known |= signatures(node, interfaces)
    return known


def _of_call(
    call: ast.Call,
    values: Mapping[str, list[ast.expr | None]],
    module: Module,
    clients: Mapping[str, str],
) -> Iterator[tuple[str, Signature]]:
    match called_name(call):
        case "create_subscription":
            type_ = _type(argument(call, 0, "msg_type"), module)
            yield from _bound(argument(call, 2, "callback"), type_, _OF_SUBSCRIPTIONS)
        case "create_service":
            type_ = _type(argument(call, 0, "srv_type"), module)
            yield from _bound(argument(call, 2, "callback"), type_, _OF_SERVICES)
        case "add_on_set_parameters_callback":
            callback = argument(call, 0, "callback")
            yield from _bound(callback, "rclpy.parameter.Parameter", _OF_PARAMETERS)
        case "ActionServer":
            type_ = _type(argument(call, 1, "action_type"), module)
            for keyword, (position, signature) in _OF_ACTION_SERVERS.items():
                at = len(call.args) if position is None else position
                yield from _bound(argument(call, at, keyword), type_, signature)
        case "send_goal":
            callback = argument(call, len(call.args), "on_feedback")
            port = dotted(call.func).removesuffix(".send_goal")
            yield from _bound(callback, clients.get(port, ""), _FEEDBACK)
        case "send_goal_async":
            callback = argument(call, 1, "feedback_callback")
            yield from _bound(callback, clients["send_goal_async"], _FEEDBACK_MESSAGE)
        case "add_done_callback" if isinstance(call.func, ast.Attribute):
            futures = (call.func.value, *values.get(dotted(call.func.value), ()))
            made = _only(called_name(item) for item in futures if isinstance(item, ast.Call))
            future = Signature((("future", _FUTURES.get(made, "")),), "")
            yield from _bound(argument(call, 0, "callback"), clients.get(made, ""), future)


def _bound(
    callback: ast.expr | None, type_: str, signature: Signature
) -> Iterator[tuple[str, Signature]]:
    """Yield the method that is passed as ``self.method``, with its signature.

    Arguments that ``partial(self.method, ...)`` adds have no known type, "".
    """
    before: tuple[tuple[str, str], ...] = ()
    if isinstance(callback, ast.Call) and last_name(callback.func) == "partial" and callback.args:
        before = (("", ""),) * (len(callback.args) - 1)
        callback = callback.args[0]
    name = dotted(callback) if callback is not None else ""
    if type_ and name.startswith("self.") and name.count(".") == 1:
        typed = signature.of(type_)
        yield name.removeprefix("self."), Signature((*before, *typed.arguments), typed.result)


def _only(types: Iterable[str]) -> str:
    """Return the type if there is one only, else ""."""
    found = {*types}
    return found.pop() if len(found) == 1 else ""


def _type(node: ast.expr | None, module: Module) -> str:
    """Return the class of an interface as the module names it at its top level, or ""."""
    name = dotted(node) if node is not None else ""
    head = name.partition(".")[0]
    return name if head in module.imports or head in module.classes else ""
