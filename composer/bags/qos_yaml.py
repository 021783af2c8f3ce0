"""QoS profiles as rosbag2 writes them: in the metadata of a channel, and in metadata.yaml.

Versions before 9 of rosbag2's metadata write the numbers of rmw's enumerations, later ones the
names.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Any, TypeVar

import yaml

from composer.bags.bag import NANOSECONDS
from composer.model.qos import Durability, History, Liveliness, QosProfile, Reliability

P = TypeVar("P", bound=StrEnum)

_PER_MILLISECOND = 1_000_000
#: rmw's RMW_DURATION_INFINITE.
_INFINITE = {"sec": 9223372036, "nsec": 854775807}
#: As long as the profiles of a thousand publishers.
_LONGEST = 500_000
#: rmw takes more, and then the middleware has no memory.
_DEEPEST = 1_000_000
#: Longer durations are one of several values that mean no limit.
_NO_LIMIT_S = 1_000_000_000
_NUMBERS: Mapping[str, Mapping[int, StrEnum]] = {
    "history": {1: History.KEEP_LAST, 2: History.KEEP_ALL},
    "reliability": {1: Reliability.RELIABLE, 2: Reliability.BEST_EFFORT},
    "durability": {1: Durability.TRANSIENT_LOCAL, 2: Durability.VOLATILE},
    "liveliness": {1: Liveliness.AUTOMATIC, 3: Liveliness.MANUAL_BY_TOPIC},
}


def to_plain(profile: QosProfile) -> dict[str, Any]:
    """Return a profile as a map of rosbag2's metadata, version 9."""
    return {
        "history": profile.history.value,
        "depth": profile.depth,
        "reliability": profile.reliability.value,
        "durability": profile.durability.value,
        "deadline": _duration(profile.deadline_ms),
        "lifespan": _duration(profile.lifespan_ms),
        "liveliness": profile.liveliness.value,
        "liveliness_lease_duration": _duration(profile.liveliness_lease_duration_ms),
        "avoid_ros_namespace_conventions": False,
    }


def to_text(profiles: Iterable[QosProfile]) -> str:
    """Return profiles as the text of a channel's metadata."""
    return yaml.safe_dump([to_plain(profile) for profile in profiles], sort_keys=False)


def from_text(text: str) -> tuple[QosProfile, ...]:
    """Return the profiles of a channel; none for a text that is none of rosbag2's."""
    if len(text) > _LONGEST or text.count("[") > 1:  # slow to parse, or deeply nested
        return ()
    try:
        found = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):  # a bag may contain anything
        return ()
    if not isinstance(found, list):
        return ()
    return tuple(from_plain(item) for item in found if isinstance(item, dict))


def from_plain(values: Mapping[str, Any]) -> QosProfile:
    """Return the profile of such a map, of any version; unknown values are the defaults."""
    default = QosProfile()
    depth = values.get("depth")
    return QosProfile(
        history=_policy(values, "history", default.history),
        depth=depth if isinstance(depth, int) and 0 < depth <= _DEEPEST else default.depth,
        reliability=_policy(values, "reliability", default.reliability),
        durability=_policy(values, "durability", default.durability),
        deadline_ms=_milliseconds(values.get("deadline")),
        lifespan_ms=_milliseconds(values.get("lifespan")),
        liveliness=_policy(values, "liveliness", default.liveliness),
        liveliness_lease_duration_ms=_milliseconds(values.get("liveliness_lease_duration")),
    )


def _policy(values: Mapping[str, Any], name: str, default: P) -> P:
    value = values.get(name)
    policies = _NUMBERS[name]
    known = {policy.value: policy for policy in policies.values()}
    found = policies.get(value) if isinstance(value, int) else known.get(str(value))
    return default if found is None else type(default)(found)


def _duration(milliseconds: float | None) -> dict[str, int]:
    if milliseconds is None:
        return dict(_INFINITE)
    seconds, nanoseconds = divmod(round(milliseconds * _PER_MILLISECOND), NANOSECONDS)
    return {"sec": seconds, "nsec": nanoseconds}


def _milliseconds(duration: object) -> float | None:
    """Return a duration; None for no limit, and for zero, which is rmw's unspecified one."""
    if not isinstance(duration, dict):
        return None
    seconds, nanoseconds = duration.get("sec"), duration.get("nsec")
    if not isinstance(seconds, int) or not isinstance(nanoseconds, int):
        return None
    if not 0 <= seconds < _NO_LIMIT_S or not 0 <= nanoseconds < NANOSECONDS:
        return None
    return (seconds * NANOSECONDS + nanoseconds) / _PER_MILLISECOND or None
