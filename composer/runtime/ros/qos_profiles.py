"""QoS profiles as rclpy wants them."""

from __future__ import annotations

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from composer.qos import QosProfile

_NANOSECONDS = 1e6


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


def _duration(milliseconds: float | None) -> Duration:
    """No limit is rmw's unspecified duration, zero, which the middleware takes for infinite."""
    return Duration(nanoseconds=round((milliseconds or 0.0) * _NANOSECONDS))
