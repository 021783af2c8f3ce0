"""A node's parameters: declared with descriptors, and checked when they change."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rcl_interfaces.msg import Parameter as ParameterMessage
from rclpy.exceptions import InvalidParameterException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from composer.model import Parameter, ParameterType

_ROS_TYPES: Mapping[str, RosParameter.Type] = {
    kind: RosParameter.Type[kind.name] for kind in ParameterType
}
_LOWEST_INTEGER, _HIGHEST_INTEGER = -(2**63), 2**63 - 1
_HIGHEST_DOUBLE = sys.float_info.max

#: Returns why the new values are not possible, or None.
Check = Callable[[Mapping[str, Any]], str | None]
#: Receives the values that have changed.
Changed = Callable[[Mapping[str, Any]], None]


class ParameterError(Exception):
    """A parameter cannot be declared with its value."""


class NodeParameters:
    """The parameters of one node. ``values`` is updated in place."""

    def __init__(
        self,
        node: Node,
        declared: Iterable[Parameter],
        *,
        check: Check,
        changed: Changed,
    ) -> None:
        """Declare the parameters. Raises ParameterError."""
        self._declared = {parameter.name.value: parameter for parameter in declared}
        self._check_values = check
        self._changed = changed
        self.values: dict[str, Any] = {}
        for parameter in self._declared.values():
            self.values[parameter.name.value] = declare(node, parameter)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def _check(self, changes: list[RosParameter]) -> SetParametersResult:
        values = {change.name: _plain(change.value) for change in changes}
        reason = self._first_problem(values)
        return SetParametersResult(successful=reason is None, reason=reason or "")

    def _first_problem(self, values: Mapping[str, Any]) -> str | None:
        for name, value in values.items():
            parameter = self._declared.get(name)
            reason = _out_of_bounds(parameter, value) if parameter is not None else None
            if reason is not None:
                return reason
        return self._check_values({**self.values, **values})

    def _apply(self, changes: list[RosParameter]) -> None:
        values = {
            change.name: _plain(change.value) for change in changes if change.name in self._declared
        }
        if values:
            self.values.update(values)
            self._changed(values)


def declare(node: Node, parameter: Parameter) -> Any:
    """Declare a parameter with its value, and return it. Raises ParameterError."""
    name = parameter.name.value
    if parameter.value is None:
        raise ParameterError(f"parameter '{name}' is required and has no value")
    value = ros_value(parameter)
    reason = _out_of_bounds(parameter, value)
    if reason is not None:
        raise ParameterError(reason)
    if node.has_parameter(name):  # rclpy declares use_sim_time for every node
        node.undeclare_parameter(name)
    try:
        if value == [] and parameter.type.value != ParameterType.BYTE_ARRAY:
            _declare_empty(node, parameter)
        else:
            node.declare_parameter(name, value, _descriptor(parameter))
    except (InvalidParameterException, InvalidParameterValueException, TypeError) as error:
        raise ParameterError(f"parameter '{name}': {error}") from error
    return _plain(value)


def parameter_message(parameter: Parameter) -> ParameterMessage:
    """Return a parameter as a message. Raises ParameterError if its value does not fit its type."""
    declared = _ROS_TYPES[ParameterType(parameter.type.value)]
    try:
        value = ros_value(parameter)
        return RosParameter(parameter.name.value, declared, value).to_parameter_msg()
    except (TypeError, ValueError, AssertionError) as error:
        raise ParameterError(f"parameter '{parameter.name}': {error}") from error


def _declare_empty(node: Node, parameter: Parameter) -> None:
    """Declare an empty array, which rclpy takes for one of bytes unless its type is given."""
    name = parameter.name.value
    declared = _ROS_TYPES[ParameterType(parameter.type.value)]
    node.declare_parameter(name, declared, _descriptor(replace(parameter, read_only=False)))
    node.set_parameters([RosParameter(name, declared, [])])
    node.describe_parameter(name).read_only = parameter.read_only


def ros_parameters(parameters: Iterable[Parameter]) -> dict[str, RosParameter]:
    """Return the values for a node that declares its parameters itself, by name.

    Empty lists without a type are left out: rclpy could not declare them.
    """
    return {
        name: RosParameter(name, _ROS_TYPES.get(parameter.type.value), ros_value(parameter))
        for parameter in parameters
        if parameter.value is not None and (parameter.value.value != [] or parameter.type.value)
        for name in (parameter.name.value,)
    }


def ros_value(parameter: Parameter) -> Any:
    """Return the value as rclpy expects it for the declared type."""
    value: Any = parameter.value.value if parameter.value is not None else None
    match parameter.type.value:
        case ParameterType.DOUBLE if isinstance(value, int) and not isinstance(value, bool):
            return float(value)
        case ParameterType.DOUBLE_ARRAY:
            return [float(item) for item in value]
        case ParameterType.BYTE_ARRAY:
            return [bytes([item]) for item in value]
        case _:
            return value


def _plain(value: Any) -> Any:
    """Return the value of a ROS parameter as behaviors and expressions see it."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__iter__"):
        return value
    items = list(value)
    if items and all(isinstance(item, bytes) for item in items):
        return b"".join(items)
    return items


def _descriptor(parameter: Parameter) -> ParameterDescriptor:
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    descriptor = ParameterDescriptor(
        name=parameter.name.value,
        type=_ROS_TYPES[ParameterType(parameter.type.value)].value,
        description=f"{parameter.description}{unit}".strip(),
        additional_constraints=_constraints(parameter),
        read_only=parameter.read_only,
    )
    if parameter.minimum is None and parameter.maximum is None:
        return descriptor
    # rclpy counts steps from the lower bound, so a step needs one.
    step = 0.0 if parameter.step is None or parameter.minimum is None else parameter.step.value
    low = None if parameter.minimum is None else parameter.minimum.value
    high = None if parameter.maximum is None else parameter.maximum.value
    if parameter.type.value == ParameterType.INTEGER:
        descriptor.integer_range = [
            IntegerRange(
                from_value=_LOWEST_INTEGER if low is None else int(low),
                to_value=_HIGHEST_INTEGER if high is None else int(high),
                step=int(step),
            )
        ]
    elif parameter.type.value == ParameterType.DOUBLE:
        descriptor.floating_point_range = [
            FloatingPointRange(
                from_value=-_HIGHEST_DOUBLE if low is None else float(low),
                to_value=_HIGHEST_DOUBLE if high is None else float(high),
                step=float(step),
            )
        ]
    return descriptor


def _constraints(parameter: Parameter) -> str:
    if parameter.choices is None:
        return ""
    return "one of: " + ", ".join(str(choice) for choice in parameter.choices.value)


def _out_of_bounds(parameter: Parameter, value: Any) -> str | None:
    """Return why ``value`` violates the choices, minimum or maximum, or None.

    For arrays, minimum and maximum apply to every item.
    """
    name = parameter.name.value
    choices = parameter.choices
    if choices is not None and value not in choices.value:
        return f"parameter '{name}' must be {_constraints(parameter)}; not {value}"
    low, high = parameter.minimum, parameter.maximum
    for item in value if isinstance(value, list) else [value]:
        if isinstance(item, bool) or not isinstance(item, (int, float)):
            continue
        if math.isnan(item) and not (low is None and high is None):
            return f"parameter '{name}' has limits and must be a number"
        if low is not None and item < low.value:
            return f"parameter '{name}' must be at least {low.value}, not {item}"
        if high is not None and item > high.value:
            return f"parameter '{name}' must be at most {high.value}, not {item}"
    return None
