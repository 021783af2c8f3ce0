"""Quality of service without rclpy: profiles, presets and the offer/request rule.

Policies and values are spelled as rclpy spells them; durations are in milliseconds and None means
"no limit" (rmw's infinite duration).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum

from composer.base.fast_dataclass import dataclass

DURATIONS = ("deadline_ms", "lifespan_ms", "liveliness_lease_duration_ms")
#: The policies that decide whether two endpoints match, and why they do not.
DECIDING_POLICIES = {
    "reliability": "the publisher does not send lost messages again",
    "durability": "the publisher does not keep messages for late joiners",
    "deadline_ms": "the publisher offers a longer deadline than the subscription requests",
    "liveliness": "the publisher does not assert its liveliness manually",
    "liveliness_lease_duration_ms": (
        "the publisher may be silent for longer than the subscription allows"
    ),
}


class History(StrEnum):
    """How many samples to keep."""

    KEEP_LAST = "keep_last"
    KEEP_ALL = "keep_all"


class Reliability(StrEnum):
    """Whether lost samples are sent again."""

    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"


class Durability(StrEnum):
    """Whether late joiners get earlier samples."""

    VOLATILE = "volatile"
    TRANSIENT_LOCAL = "transient_local"


class Liveliness(StrEnum):
    """How a publisher asserts that it is alive."""

    AUTOMATIC = "automatic"
    MANUAL_BY_TOPIC = "manual_by_topic"


#: The policies that are words, and those that are durations.
WORDS: Mapping[str, type[StrEnum]] = {
    "history": History,
    "reliability": Reliability,
    "durability": Durability,
    "liveliness": Liveliness,
}


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

    @property
    def queue_depth(self) -> int | None:
        """Maximum number of queued messages; None if the history keeps all."""
        return None if self.history is History.KEEP_ALL else max(self.depth, 1)


#: The policies that discovery reports for publishers and subscriptions: not the queue.
DISCOVERED_POLICIES = tuple(
    policy for policy in QosProfile.__annotations__ if policy not in {"history", "depth"}
)


#: The predefined profiles.
#:
#: ``sensor_data``, ``services_default`` and ``parameters`` are those of rmw/qos_profiles.h.
#: ``command`` and ``state`` are two common patterns: commands that must arrive, and a latest value
#: that late joiners get. In ROS, ``system_default`` leaves the choice to the middleware, and Fast
#: DDS chooses differently for publishers (reliable, transient local) and subscriptions (best
#: effort, volatile). A declared system is explicit, so here it is rclpy's default for topics.
PRESETS: Mapping[str, QosProfile] = {
    "sensor_data": QosProfile(depth=5, reliability=Reliability.BEST_EFFORT),
    "command": QosProfile(),
    "state": QosProfile(depth=1, durability=Durability.TRANSIENT_LOCAL),
    "services_default": QosProfile(),
    "parameters": QosProfile(depth=1000),
    "system_default": QosProfile(),
}


def strongest(profiles: Iterable[QosProfile]) -> tuple[Reliability, Durability]:
    """Return the policies of an offer that satisfies the reliability and durability of all."""
    found = tuple(profiles)
    reliable = any(item.reliability is Reliability.RELIABLE for item in found)
    latched = any(item.durability is Durability.TRANSIENT_LOCAL for item in found)
    return (
        Reliability.RELIABLE if reliable else Reliability.BEST_EFFORT,
        Durability.TRANSIENT_LOCAL if latched else Durability.VOLATILE,
    )


def strictest(requests: Sequence[QosProfile]) -> QosProfile:
    """Return the profile that exactly the offers match which match each of the ``requests``."""
    reliability, durability = strongest(requests)
    deadlines_ms = [item.deadline_ms for item in requests if item.deadline_ms is not None]
    leases_ms = [
        item.liveliness_lease_duration_ms
        for item in requests
        if item.liveliness_lease_duration_ms is not None
    ]
    is_manual = any(item.liveliness is Liveliness.MANUAL_BY_TOPIC for item in requests)
    return QosProfile(
        reliability=reliability,
        durability=durability,
        deadline_ms=min(deadlines_ms, default=None),
        liveliness=Liveliness.MANUAL_BY_TOPIC if is_manual else Liveliness.AUTOMATIC,
        liveliness_lease_duration_ms=min(leases_ms, default=None),
    )


def strictest_compatible(offers: Sequence[QosProfile], depth: int) -> QosProfile:
    """Return the strictest profile of a subscription that is compatible with every offer."""
    reliable = all(offer.reliability is Reliability.RELIABLE for offer in offers)
    transient = all(offer.durability is Durability.TRANSIENT_LOCAL for offer in offers)
    return QosProfile(
        depth=depth,
        reliability=Reliability.RELIABLE if offers and reliable else Reliability.BEST_EFFORT,
        durability=Durability.TRANSIENT_LOCAL if offers and transient else Durability.VOLATILE,
    )


@dataclass(frozen=True, slots=True)
class Incompatibility:
    """A policy in which an offer is weaker than the request, so that endpoints never match."""

    policy: str
    offered: str
    requested: str
    reason: str


#: What an offer and a request of a policy must not be.
_MISMATCHES: Mapping[str, tuple[StrEnum, StrEnum]] = {
    "reliability": (Reliability.BEST_EFFORT, Reliability.RELIABLE),
    "durability": (Durability.VOLATILE, Durability.TRANSIENT_LOCAL),
    "liveliness": (Liveliness.AUTOMATIC, Liveliness.MANUAL_BY_TOPIC),
}


def incompatibilities(offered: QosProfile, requested: QosProfile) -> tuple[Incompatibility, ...]:
    """Return all policies that prevent two endpoints from matching.

    A publisher or server offers, a subscription or client requests, and the offer must be at least
    as strong. The rule comes from DDS (OMG DDS 1.4, 2.2.3) as ``rmw_qos_profile_check_compatible``
    states it. History, depth and lifespan never matter.
    """
    if offered is requested:
        return ()
    found = []
    for policy, reason in DECIDING_POLICIES.items():
        offer, request = getattr(offered, policy), getattr(requested, policy)
        mismatch = _MISMATCHES.get(policy)
        if _is_longer(offer, request) if mismatch is None else (offer, request) == mismatch:
            found.append(Incompatibility(policy, _shown(offer), _shown(request), reason))
    return tuple(found)


def _is_longer(offered_ms: float | None, requested_ms: float | None) -> bool:
    if requested_ms is None:
        return False
    return offered_ms is None or offered_ms > requested_ms


def _shown(value: str | float | None) -> str:
    if value is None:
        return "no limit"
    return value if isinstance(value, str) else f"{value:g} ms"
