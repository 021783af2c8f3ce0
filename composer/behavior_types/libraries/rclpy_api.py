"""The types of what classes of rclpy take and give, read from ``rclpy.pyi`` next to this file."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path

from composer.behavior_source import Module
from composer.behavior_source.syntax import read_module
from composer.behavior_types.values import (
    InterfaceClass,
    OwnClass,
    OwnObject,
    Value,
)
from composer.field_types import ANYTHING
from composer.interfaces import Action, Message, Service

_FILE = Path(__file__).with_name("rclpy.pyi")
_NAME = re.compile(r"rclpy((?:\.[a-z_]+)*)\.(\w+)")
#: Other names of the classes in the file.
_ALIASES = {
    "LifecyclePublisher": "Publisher",
    "QoSDurabilityPolicy": "DurabilityPolicy",
    "QoSHistoryPolicy": "HistoryPolicy",
    "QoSLivelinessPolicy": "LivelinessPolicy",
    "QoSReliabilityPolicy": "ReliabilityPolicy",
    "State": "LifecycleState",
}
#: What the lifecycle module names otherwise.
_OF_LIFECYCLE = {"Node": "LifecycleNode", "NodeMixin": ""}
#: Classes in the file that rclpy does not have under this name.
_UNNAMED = frozenset({"FeedbackMessage", "GoalOutcome"})
#: The interfaces that parameters of rclpy take, by the name of the annotation.
CLASSES: Mapping[str, type] = {
    "ActionClass": Action,
    "MessageClass": Message,
    "ServiceClass": Service,
}


def rclpy_class(full: str) -> OwnClass | None:
    """Return the class of rclpy with that full name, None if it is not known."""
    found = _NAME.fullmatch(full)
    if found is None or found[1].startswith(".impl"):
        return None
    module, name = found.groups()
    name = _ALIASES.get(name, name)
    if module == ".lifecycle":
        name = _OF_LIFECYCLE.get(name, name)
    return None if name in _UNNAMED else _class(name)


def rclpy_value(full: str) -> Value:
    """Return the type of a class or constant of rclpy with that full name."""
    if not full.startswith("rclpy."):
        return ANYTHING
    if full.startswith("rclpy.qos.qos_profile_"):
        return rclpy_object("QoSProfile")
    return rclpy_class(full) or ANYTHING


def rclpy_object(name: str, parameter: Value = ANYTHING) -> Value:
    """Return the type of an object of a class of rclpy."""
    found = _class(name)
    return OwnObject(found, parameter) if found is not None else ANYTHING


def is_rclpy(home: Module) -> bool:
    """Return whether a module is the description of rclpy."""
    return home.path == _FILE


def _class(name: str) -> OwnClass | None:
    module = rclpy_module()
    found = module.classes.get(name)
    return OwnClass(found, module) if found is not None else None


@lru_cache(maxsize=1)
def rclpy_module() -> Module:
    """Return the description of rclpy."""
    return read_module(_FILE, _FILE.name)


def generic(annotation: ast.expr, parameter: Value, plain: Callable[[ast.expr], Value]) -> Value:
    """Return the type of an annotation in the description of rclpy.

    ``parameter`` takes the place of ``T`` and of the classes that a method takes; ``plain`` gives
    the type of any other annotation.
    """
    match annotation:
        case ast.Name(id="T"):
            return parameter
        case ast.Name(id=name) if name in CLASSES:
            return _instance(parameter)
        case ast.Subscript(value=ast.Name(id=name), slice=inner) if name in _PARTS:
            return _PARTS[name](generic(inner, parameter, plain))
        case ast.Subscript(value=ast.Name(id=name), slice=inner) if own := _class(name):
            return OwnObject(own, generic(inner, parameter, plain))
        case _:
            return plain(annotation)


def _instance(parameter: Value) -> Value:
    """Return a message in the place of its class."""
    definition = parameter.definition if isinstance(parameter, InterfaceClass) else None
    return definition if isinstance(definition, Message) else parameter


def _message(parameter: Value) -> Value:
    return parameter if isinstance(parameter, Message) else ANYTHING


def _part(name: str) -> Callable[[Value], Value]:
    def part_of(parameter: Value) -> Value:
        definition = parameter.definition if isinstance(parameter, InterfaceClass) else None
        found = getattr(definition, name, None)
        return found if isinstance(found, Message) else ANYTHING

    return part_of


_PARTS: Mapping[str, Callable[[Value], Value]] = {
    "Message": _message,
    "Request": _part("request"),
    "Response": _part("response"),
    "Goal": _part("goal"),
    "Result": _part("result"),
    "Feedback": _part("feedback"),
}


#: What arithmetic with times of rclpy gives: Duration has none of its own.
_OF_TIMES = {
    ("Time", "+", "Duration"): "Time",
    ("Duration", "+", "Time"): "Time",
    ("Time", "-", "Duration"): "Time",
    ("Time", "-", "Time"): "Duration",
}


def time_arithmetic(left: Value, sign: str, right: Value) -> Value:
    """Return the type of the sum or the difference of times of rclpy, ANYTHING without one."""
    result = _OF_TIMES.get((_class_name(left), sign, _class_name(right)))
    return rclpy_object(result) if result is not None else ANYTHING


def is_time(value: Value) -> bool:
    """Return whether a value is a Time or a Duration of rclpy."""
    return _class_name(value) in {"Time", "Duration"}


def order_of_rclpy(value: Value) -> str:
    """Return what a time of rclpy can be compared with, "" for other values."""
    return f"a {_class_name(value)} of rclpy" if is_time(value) else ""


def _class_name(value: Value) -> str:
    is_known = isinstance(value, OwnObject) and is_rclpy(value.of.home)
    return value.of.definition.name if is_known and isinstance(value, OwnObject) else ""
