"""QoS profiles to and from rclpy's, and values and descriptors of parameters to plain data."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from typing import Any, TypeVar

from rcl_interfaces.msg import ParameterDescriptor, ParameterValue
from rclpy.duration import Duration
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from composer.model import ParameterType
from composer.model.qos import Durability, History, Liveliness, QosProfile, Reliability
from composer.runtime.protocol.requests import ParameterDescription

P = TypeVar("P", bound=Enum)

_NANOSECONDS = 1e6  # per millisecond
#: Durations above are rmw's infinite duration: no limit.
_NO_LIMIT_MS = 1e12
NOT_SET = "not set"
_TYPES = {RosParameter.Type.NOT_SET.value: NOT_SET} | {
    RosParameter.Type[kind.name].value: kind.value for kind in ParameterType
}


def rclpy_profile(profile: QosProfile) -> QoSProfile:
    """Return ``profile`` as rclpy's class."""
    return QoSProfile(
        history=HistoryPolicy[profile.history.name],
        depth=profile.depth,
        reliability=ReliabilityPolicy[profile.reliability.name],
        durability=DurabilityPolicy[profile.durability.name],
        deadline=_duration(profile.deadline_ms),
        lifespan=_duration(profile.lifespan_ms),
        liveliness=LivelinessPolicy[profile.liveliness.name],
        liveliness_lease_duration=_duration(profile.liveliness_lease_duration_ms),
    )


def discovered_profile(profile: QoSProfile) -> QosProfile:
    """Return the profile of a discovered endpoint. History and depth are usually not discovered."""
    return QosProfile(
        history=_policy(History, profile.history, History.KEEP_LAST),
        reliability=_policy(Reliability, profile.reliability, Reliability.RELIABLE),
        durability=_policy(Durability, profile.durability, Durability.VOLATILE),
        deadline_ms=_milliseconds(profile.deadline),
        lifespan_ms=_milliseconds(profile.lifespan),
        liveliness=_policy(Liveliness, profile.liveliness, Liveliness.AUTOMATIC),
        liveliness_lease_duration_ms=_milliseconds(profile.liveliness_lease_duration),
    )


def _policy(kind: type[P], policy: Enum, default: P) -> P:
    """Return a policy of rclpy as ours; the default if it is unknown or the system's default."""
    return kind[policy.name] if policy.name in kind.__members__ else default


def own_profile(profile: QoSProfile) -> QosProfile:
    """Return the profile that an endpoint of this process was created with."""
    found = discovered_profile(profile)
    return replace(
        found,
        depth=profile.depth,
        # Zero is rmw's unspecified duration.
        deadline_ms=found.deadline_ms or None,
        lifespan_ms=found.lifespan_ms or None,
        liveliness_lease_duration_ms=found.liveliness_lease_duration_ms or None,
    )


def _duration(milliseconds: float | None) -> Duration:
    """Return a duration; zero, which is rmw's unspecified duration, for no limit."""
    return Duration(nanoseconds=round((milliseconds or 0.0) * _NANOSECONDS))


def _milliseconds(duration: Any) -> float | None:
    milliseconds = duration.nanoseconds / _NANOSECONDS
    return None if milliseconds >= _NO_LIMIT_MS else milliseconds


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
