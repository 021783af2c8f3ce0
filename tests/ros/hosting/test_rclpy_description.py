"""The description of rclpy that validation uses agrees with the rclpy that is installed."""

from __future__ import annotations

import inspect
from enum import Enum

import pytest
import rclpy.action
import rclpy.action.client
import rclpy.action.server
import rclpy.callback_groups
import rclpy.clock
import rclpy.duration
import rclpy.guard_condition
import rclpy.impl.rcutils_logger
import rclpy.lifecycle
import rclpy.logging
import rclpy.node
import rclpy.qos
import rclpy.task
import rclpy.time

from composer.behavior_types.libraries.rclpy_api import rclpy_class, rclpy_module
from composer.behavior_types.syntax.own_classes import is_enumeration, known_attributes

pytestmark = pytest.mark.ros

CLASSES = {
    "ActionClient": rclpy.action.ActionClient,
    "ActionServer": rclpy.action.ActionServer,
    "CancelResponse": rclpy.action.CancelResponse,
    "Client": rclpy.node.Client,
    "ClientGoalHandle": rclpy.action.client.ClientGoalHandle,
    "Clock": rclpy.clock.Clock,
    "ClockType": rclpy.clock.ClockType,
    "Duration": rclpy.duration.Duration,
    "DurabilityPolicy": rclpy.qos.DurabilityPolicy,
    "Future": rclpy.task.Future,
    "GoalResponse": rclpy.action.GoalResponse,
    "GuardCondition": rclpy.guard_condition.GuardCondition,
    "HistoryPolicy": rclpy.qos.HistoryPolicy,
    "LifecycleNode": rclpy.lifecycle.LifecycleNode,
    "LifecycleState": rclpy.lifecycle.State,
    "LivelinessPolicy": rclpy.qos.LivelinessPolicy,
    "LoggingSeverity": rclpy.logging.LoggingSeverity,
    "Node": rclpy.node.Node,
    "Parameter": rclpy.node.Parameter,
    "Publisher": rclpy.lifecycle.Publisher,
    "QoSPresetProfiles": rclpy.qos.QoSPresetProfiles,
    "QoSProfile": rclpy.qos.QoSProfile,
    "Rate": rclpy.node.Rate,
    "RcutilsLogger": rclpy.impl.rcutils_logger.RcutilsLogger,
    "ReliabilityPolicy": rclpy.qos.ReliabilityPolicy,
    "ServerGoalHandle": rclpy.action.server.ServerGoalHandle,
    "Service": rclpy.node.Service,
    "Subscription": rclpy.node.Subscription,
    "Time": rclpy.time.Time,
    "Timer": rclpy.node.Timer,
    "TransitionCallbackReturn": rclpy.lifecycle.TransitionCallbackReturn,
}
#: What rclpy does not have as a class of its own, or only from the middleware.
DESCRIBED_ONLY = {"FeedbackMessage", "GoalOutcome"}
#: Methods that take any arguments in rclpy and pass them on.
PASSED_ON = {
    ("Clock", "__init__"),  # made by __new__
    ("LifecycleNode", "create_lifecycle_publisher"),
    ("QoSProfile", "__init__"),
    ("TransitionCallbackReturn", "to_label"),
}


def test_every_class_is_compared() -> None:
    assert set(rclpy_module().classes) == set(CLASSES) | DESCRIBED_ONLY


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_no_attribute_of_a_class_is_missing(name: str) -> None:
    own = rclpy_class(f"rclpy.{name}")
    assert own is not None
    known = known_attributes(own)
    assert known is not None
    if name == "LifecycleNode":  # what it inherits is described there
        node = rclpy_class("rclpy.node.Node")
        known |= known_attributes(node) if node is not None else frozenset()
    public = {item for item in dir(CLASSES[name]) if not item.startswith("_")}
    public -= set(dir(int)) if issubclass(CLASSES[name], int) else set()
    assert public - known == {"when_enabled"} & public


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_methods_take_what_those_of_rclpy_take(name: str) -> None:
    own = rclpy_class(f"rclpy.{name}")
    assert own is not None
    for method in own.definition.methods:
        function = method.node
        if function is None or is_enumeration(own) or (name, method.name) in PASSED_ON:
            continue
        if method.name.startswith("__") and method.name != "__init__":
            assert hasattr(CLASSES[name], method.name)
            continue
        parameters = inspect.signature(getattr(CLASSES[name], method.name)).parameters.values()
        required = {
            item.name
            for item in parameters
            if item.default is item.empty
            and item.kind not in (item.VAR_POSITIONAL, item.VAR_KEYWORD)
        }
        arguments = function.args
        described = [item.arg for item in (*arguments.args, *arguments.kwonlyargs)]
        expected = [item.name for item in parameters if item.kind is not item.VAR_KEYWORD]
        assert [item for item in described if item != "self"] == [
            item for item in expected if item != "self"
        ], method.name
        defaults = {
            item.arg for item in arguments.args[len(arguments.args) - len(arguments.defaults) :]
        }
        defaults |= {
            item.arg
            for item, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
            if default is not None
        }
        assert set(described) - defaults - {"self"} == required - {"self"}, method.name


def test_members_of_enumerations_exist() -> None:
    for name, real in CLASSES.items():
        if isinstance(real, type) and issubclass(real, Enum):
            own = rclpy_class(f"rclpy.{name}")
            assert own is not None
            known = known_attributes(own) or frozenset()
            assert all(hasattr(real, item) for item in known if item.isupper()), name
