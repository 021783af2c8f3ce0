"""Converts QoS profiles to and from rclpy's."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from typing import Any, TypeVar

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from composer.model.qos import Durability, History, Liveliness, QosProfile, Reliability

P = TypeVar("P", bound=Enum)

_NANOSECONDS = 1e6  # per millisecond
#: Durations above are rmw's infinite duration: no limit.
_NO_LIMIT_MS = 1e12


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
