"""Quality of service without rclpy: profiles, presets and the offer/request rule.

Policies and values are spelled as rclpy spells them; durations are in milliseconds and None means
"no limit" (rmw's infinite duration).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class History(StrEnum):
    """How many samples an endpoint keeps."""

    KEEP_LAST = "keep_last"
    KEEP_ALL = "keep_all"


class Reliability(StrEnum):
    """Whether a lost sample is sent again."""

    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"


class Durability(StrEnum):
    """Whether a late joiner gets what was published before it came."""

    VOLATILE = "volatile"
    TRANSIENT_LOCAL = "transient_local"


class Liveliness(StrEnum):
    """Who asserts that a publisher is alive."""

    AUTOMATIC = "automatic"
    MANUAL_BY_TOPIC = "manual_by_topic"


@dataclass(frozen=True, slots=True)
class QosProfile:
    """A complete QoS profile. The defaults are those of ``rclpy.qos.QoSProfile(depth=10)``."""

    history: History = History.KEEP_LAST
    depth: int = 10
    reliability: Reliability = Reliability.RELIABLE
    durability: Durability = Durability.VOLATILE
    deadline_ms: float | None = None
    lifespan_ms: float | None = None
    liveliness: Liveliness = Liveliness.AUTOMATIC
    liveliness_lease_duration_ms: float | None = None
