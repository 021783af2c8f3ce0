"""Converts values and descriptors of parameters (rcl_interfaces) to plain data."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, ParameterType, ParameterValue
from rclpy.parameter import parameter_value_to_python

from composer.runtime.protocol.requests import ParameterDescription

NOT_SET = "not set"
_TYPES = {
    ParameterType.PARAMETER_NOT_SET: NOT_SET,
    ParameterType.PARAMETER_BOOL: "bool",
    ParameterType.PARAMETER_INTEGER: "integer",
    ParameterType.PARAMETER_DOUBLE: "double",
    ParameterType.PARAMETER_STRING: "string",
    ParameterType.PARAMETER_BYTE_ARRAY: "byte_array",
    ParameterType.PARAMETER_BOOL_ARRAY: "bool_array",
    ParameterType.PARAMETER_INTEGER_ARRAY: "integer_array",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "double_array",
    ParameterType.PARAMETER_STRING_ARRAY: "string_array",
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
