"""Converts values and descriptors of parameters (rcl_interfaces) to plain data."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, ParameterValue
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python

from composer.model import ParameterType
from composer.runtime.protocol.requests import ParameterDescription

NOT_SET = "not set"
_TYPES = {RosParameter.Type.NOT_SET.value: NOT_SET} | {
    RosParameter.Type[kind.name].value: kind.value for kind in ParameterType
}


def plain_value(value: ParameterValue) -> Any:
    """Return the value as plain data; byte strings become numbers, unknown types None."""
    found = parameter_value_to_python(value) if value.type in _TYPES else None
    if isinstance(found, list):
        return [item[0] if isinstance(item, bytes) else item for item in found]
    return found


def description(name: str, found: ParameterDescriptor) -> ParameterDescription:
    """Return the description of the parameter ``name``."""
    bounds = [*found.floating_point_range, *found.integer_range]
    return ParameterDescription(
        name=name,
        type=_TYPES.get(found.type, f"unknown type {found.type}"),
        description=found.description,
        constraints=found.additional_constraints,
        read_only=found.read_only,
        minimum=bounds[0].from_value if bounds else None,
        maximum=bounds[0].to_value if bounds else None,
        step=(bounds[0].step or None) if bounds else None,
    )
