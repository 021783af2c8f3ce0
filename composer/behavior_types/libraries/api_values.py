"""The types of what the API for behaviors returns, and of the parts of interfaces."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import cache

from composer import behavior
from composer.behavior_types.api import members
from composer.behavior_types.values import NONE, ApiMethod, ApiValue, InterfaceClass, Value
from composer.field_types import ANYTHING, BOOL, NUMBER, STATUS, STRING
from composer.interfaces import Action, Interfaces, Message, Service

_ANNOTATIONS: Mapping[str, Value] = {
    "str": STRING,
    "bool": BOOL,
    "float": NUMBER,
    "None": NONE,
}
_TIME = "builtin_interfaces/msg/Time"
_TRANSFORM = "geometry_msgs/msg/TransformStamped"
#: The messages that parameters of methods take, by class and name.
_MESSAGES: Mapping[str, Mapping[str, str]] = {
    "Transforms": {"transform": "geometry_msgs/msg/Transform", "stamp": _TIME},
}


def api_parameters(class_name: str, method: str, interfaces: Interfaces) -> Mapping[str, Value]:
    """Return the types of the parameters of a method of the API, as far as they are known."""
    known = _plain_parameters(class_name, method)
    messages = _MESSAGES.get(class_name, {})
    return {name: _message(messages.get(name), interfaces) or known[name] for name in known}


def _message(name: str | None, interfaces: Interfaces) -> Message | None:
    return None if name is None else interfaces.message(name)


@cache
def _plain_parameters(class_name: str, method: str) -> Mapping[str, Value]:
    annotations = inspect.get_annotations(getattr(getattr(behavior, class_name), method))
    known = {name: _ANNOTATIONS.get(text, ANYTHING) for name, text in annotations.items()}
    return {name: type_ for name, type_ in known.items() if name != "return"}


def api_member(owner: ApiValue, name: str, interfaces: Interfaces) -> Value:
    """Return the type of an attribute of a value of the API."""
    member = members(owner.class_name).get(name)
    if member is None:
        return ANYTHING
    return ApiMethod(owner, member) if member.is_method else api_result(owner, name, interfaces)


def api_result(owner: ApiValue, name: str, interfaces: Interfaces) -> Value:
    """Return the type of a property, or of what a method returns."""
    definition = interfaces.find(owner.port.interface.value) if owner.port else None
    match owner.class_name, name, definition:
        case "Publisher", "message_type", Message() as message:
            return InterfaceClass(message)
        case "Client", "service_type", Service() as service:
            return InterfaceClass(service)
        case "Client", "call", Service() as service:
            return service.response
        case "ActionClient", "action_type", Action() as action:
            return InterfaceClass(action)
        case "GoalResult", "result", Action() as action:
            return action.result
        case "Goal", "request", Action() as action:
            return action.goal
        case "GoalResult", "status", _:
            return STATUS
        case "Clock", "stamp", _:
            return interfaces.message(_TIME) or ANYTHING
        case "Transforms", "lookup" | "wait", _:
            return interfaces.message(_TRANSFORM) or ANYTHING
    annotation = members(owner.class_name)[name].annotation
    if annotation in {"SentGoal", "GoalResult"}:
        return ApiValue(annotation, owner.port)
    return _ANNOTATIONS.get(annotation, ANYTHING)


def class_member(definition: Message | Service | Action, name: str) -> Value:
    """Return the type of an attribute of an interface class: a part, or a constant."""
    part = None
    if isinstance(definition, Service) and name in {"Request", "Response"}:
        part = definition.request if name == "Request" else definition.response
    if isinstance(definition, Action) and name in {"Goal", "Result", "Feedback"}:
        part = getattr(definition, name.lower())
    if isinstance(definition, Message):
        found = (item.type for item in definition.constants if item.name == name)
        return next(found, ANYTHING)
    return InterfaceClass(part) if isinstance(part, Message) else ANYTHING
