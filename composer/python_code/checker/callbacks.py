"""The callbacks of a class: which methods the composer and rclpy call, with what arguments."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping

from composer.interfaces import Interfaces
from composer.model import Node, PortKind
from composer.python_code.lookup import imported_from
from composer.python_code.nodes import Signature
from composer.python_code.stubs.behaviors import port_type, signatures
from composer.python_code.syntax import Module
from composer.python_code.trees import Function, argument, bindings, called_name, dotted, last_name

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
