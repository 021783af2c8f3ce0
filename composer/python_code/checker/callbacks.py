"""The callbacks of rclpy classes: which methods are passed to rclpy, and with what arguments."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import field

from composer.fast_dataclass import dataclass
from composer.python_code.source import Module
from composer.python_code.source.method_body import argument, dotted
from composer.python_code.stubs.behaviors import Signature

_HANDLE = "rclpy.action.server.ServerGoalHandle[{0}.Goal, {0}.Result, {0}.Feedback]"
_SENT_GOAL = "rclpy.action.client.ClientGoalHandle[{0}.Goal, {0}.Result, {0}.Feedback]"
#: The callbacks of an action server: their position, argument and result.
_OF_ACTION_SERVERS = {
    "execute_callback": (3, ("goal_handle", _HANDLE), "{0}.Result"),
    "goal_callback": (None, ("goal_request", "{0}.Goal"), ""),
    "cancel_callback": (None, ("goal_handle", _HANDLE), ""),
    "handle_accepted_callback": (None, ("goal_handle", _HANDLE), ""),
}
_OF_ACTIONS = frozenset({"get_result_async", "send_goal_async"})
_FEEDBACK = "rclpy.action.client._FeedbackMessage[{0}.Feedback]"
#: The functions that create clients, with the position and name of the argument for their type.
_CLIENTS = {"create_client": (0, "srv_type"), "ActionClient": (1, "action_type")}
_FUTURES = {
    "call_async": "rclpy.task.Future[{0}.Response]",
    "send_goal_async": f"rclpy.task.Future[{_SENT_GOAL}]",
    "get_result_async": "rclpy.task.Future[rclpy.action.client._GetResultResponse[{0}.Result]]",
}


@dataclass(slots=True)
class _Names:
    """Where a class stores clients and futures, as written, each with its type."""

    clients: dict[str, str] = field(default_factory=dict)
    futures: dict[str, str] = field(default_factory=dict)
    actions: list[str] = field(default_factory=list)

    @property
    def action(self) -> str:
        """The only action that the class has clients for, else ""."""
        return self.actions[0] if len(set(self.actions)) == 1 else ""

    def client_of(self, call: ast.Call) -> str:
        """Return the type of the client whose method is called; "" if it is unknown."""
        known = self.clients.get(dotted(call.func).rpartition(".")[0], "")
        return known or (self.action if _last(call.func) in _OF_ACTIONS else "")

    def future_of(self, call: ast.Call) -> str:
        """Return the type of the future that a call returns; "" if it is unknown."""
        client = self.client_of(call)
        return _FUTURES.get(_last(call.func), "").format(client) if client else ""


def callback_signatures(node: ast.ClassDef, module: Module) -> dict[str, Signature]:
    """Return the methods of a class that it passes to rclpy, with what they are called with.

    A method that is passed as a callback of several types is left out.
    """
    found: dict[str, set[Signature]] = {}
    names = _names(node, module)
    for call in ast.walk(node):
        for name, signature in _of_call(call, module, names) if isinstance(call, ast.Call) else ():
            found.setdefault(name, set()).add(signature)
    return {name: items.pop() for name, items in found.items() if len(items) == 1}


def _of_call(call: ast.Call, module: Module, names: _Names) -> Iterator[tuple[str, Signature]]:
    match _last(call.func):
        case "create_subscription":
            type_ = _type(argument(call, 0, "msg_type"), module)
            yield from _bound(argument(call, 2, "callback"), type_, (("message", "{0}"),))
        case "create_service":
            type_ = _type(argument(call, 0, "srv_type"), module)
            arguments = (("request", "{0}.Request"), ("response", "{0}.Response"))
            callback = argument(call, 2, "callback")
            yield from _bound(callback, type_, arguments, "{0}.Response")
        case "ActionServer":
            type_ = _type(argument(call, 1, "action_type"), module)
            for keyword, (position, taken, result) in _OF_ACTION_SERVERS.items():
                at = len(call.args) if position is None else position
                yield from _bound(argument(call, at, keyword), type_, (taken,), result)
        case "send_goal_async":
            type_ = names.client_of(call)
            callback = argument(call, 1, "feedback_callback")
            yield from _bound(callback, type_, (("feedback_message", _FEEDBACK),))
        case "add_done_callback" if isinstance(call.func, ast.Attribute):
            receiver = call.func.value
            is_call = isinstance(receiver, ast.Call)
            future = names.future_of(receiver) if is_call else names.futures.get(dotted(receiver))
            yield from _bound(argument(call, 0, "callback"), future or "", (("future", "{0}"),))


def _bound(
    callback: ast.expr | None, type_: str, arguments: tuple[tuple[str, str], ...], result: str = ""
) -> Iterator[tuple[str, Signature]]:
    """Yield the method that is passed as ``self.method``, with its signature.

    Arguments that ``partial(self.method, ...)`` adds have no known type, "".
    """
    before: tuple[tuple[str, str], ...] = ()
    if isinstance(callback, ast.Call) and _last(callback.func) == "partial" and callback.args:
        before = (("", ""),) * (len(callback.args) - 1)
        callback = callback.args[0]
    name = dotted(callback) if callback is not None else ""
    if type_ and name.startswith("self.") and name.count(".") == 1:
        taken = tuple((argument_name, text.format(type_)) for argument_name, text in arguments)
        taken = (*before, *taken)
        yield name.removeprefix("self."), Signature(taken, result.format(type_))


def _names(node: ast.ClassDef, module: Module) -> _Names:
    names = _Names()
    assigned = [
        (dotted(item.targets[0]), item.value)
        for item in ast.walk(node)
        if isinstance(item, ast.Assign) and isinstance(item.value, ast.Call)
    ]
    for name, call in assigned:
        made = _last(call.func)
        if name and made in _CLIENTS:
            names.clients[name] = _type(argument(call, *_CLIENTS[made]), module)
            names.actions += [names.clients[name]] if made == "ActionClient" else []
    futures: dict[str, set[str]] = {}
    for name, call in assigned:
        if name and _last(call.func) in _FUTURES:
            futures.setdefault(name, set()).add(names.future_of(call))
    names.futures = {name: types.pop() for name, types in futures.items() if len(types) == 1}
    return names


def _last(node: ast.expr) -> str:
    return str(getattr(node, "attr", getattr(node, "id", "")))


def _type(node: ast.expr | None, module: Module) -> str:
    """Return the class of an interface as the module names it at its top level, or ""."""
    name = dotted(node) if node is not None else ""
    head = name.partition(".")[0]
    return name if head in module.imports or head in module.classes else ""
