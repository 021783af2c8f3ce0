"""``composer.model.qos`` against rclpy: the rule over all combinations of policies, presets."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import pytest
from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
    qos_profile_parameters,
    qos_profile_sensor_data,
    qos_profile_services_default,
)

from composer.model.qos import (
    PRESETS,
    Durability,
    History,
    Liveliness,
    QosProfile,
    Reliability,
    incompatibilities,
)

PERIODS_MS = (None, 10.0, 20.0)
#: rclpy names the policies in the reason it gives; these are its words for ours.
WORDS = {
    "reliability": "Best effort publisher and reliable subscription",
    "durability": "Volatile publisher and transient local subscription",
    "deadline_ms": "deadline",
    "liveliness": "Publisher's liveliness is automatic and subscription's is manual by topic",
    "liveliness_lease_duration_ms": "liveliness lease duration",
}


def rclpy_profile(profile: QosProfile) -> QoSProfile:
    """Return the same profile as rclpy has it; 0 is its 'no limit'."""

    def duration(milliseconds: float | None) -> Duration:
        return Duration(nanoseconds=int((milliseconds or 0.0) * 1e6))

    return QoSProfile(
        history=HistoryPolicy[profile.history.name],
        depth=profile.depth,
        reliability=ReliabilityPolicy[profile.reliability.name],
        durability=DurabilityPolicy[profile.durability.name],
        deadline=duration(profile.deadline_ms),
        lifespan=duration(profile.lifespan_ms),
        liveliness=LivelinessPolicy[profile.liveliness.name],
        liveliness_lease_duration=duration(profile.liveliness_lease_duration_ms),
    )


def all_profiles() -> Iterator[QosProfile]:
    """Every combination of policy values that can matter."""
    for reliability, durability, deadline, liveliness, lease in product(
        Reliability, Durability, PERIODS_MS, Liveliness, PERIODS_MS
    ):
        yield QosProfile(
            reliability=reliability,
            durability=durability,
            deadline_ms=deadline,
            liveliness=liveliness,
            liveliness_lease_duration_ms=lease,
        )


def test_every_pair_of_profiles_is_checked_as_in_rclpy() -> None:
    profiles = [(profile, rclpy_profile(profile)) for profile in all_profiles()]
    wrong = []
    for (offered, offered_ros), (requested, requested_ros) in product(profiles, profiles):
        verdict, reason = qos_check_compatible(offered_ros, requested_ros)
        expected = {policy for policy, words in WORDS.items() if words in reason}
        found = {item.policy for item in incompatibilities(offered, requested)}
        if (verdict == QoSCompatibility.OK) != (not found) or found != expected:
            wrong.append((offered, requested, found, reason))
    assert len(profiles) ** 2 == 72**2
    assert wrong == []


@pytest.mark.parametrize("history", History)
@pytest.mark.parametrize("lifespan_ms", [None, 1.0])
def test_history_depth_and_lifespan_do_not_matter_to_rclpy_either(
    history: History, lifespan_ms: float | None
) -> None:
    odd = QosProfile(history=history, depth=1, lifespan_ms=lifespan_ms)
    plain = QosProfile()
    for offered, requested in ((odd, plain), (plain, odd)):
        verdict, _ = qos_check_compatible(rclpy_profile(offered), rclpy_profile(requested))
        assert verdict == QoSCompatibility.OK
        assert incompatibilities(offered, requested) == ()


def without_liveliness(profile: QoSProfile) -> dict[str, object]:
    """rclpy leaves the liveliness to the middleware; DDS's own default is automatic."""
    policies = {name.lstrip("_"): getattr(profile, name) for name in profile.__slots__}
    assert policies.pop("liveliness") in (
        LivelinessPolicy.SYSTEM_DEFAULT,
        LivelinessPolicy.AUTOMATIC,
    )
    return policies


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("sensor_data", qos_profile_sensor_data),
        ("services_default", qos_profile_services_default),
        ("parameters", qos_profile_parameters),
        ("command", QoSProfile(depth=10)),
        ("system_default", QoSProfile(depth=10)),
    ],
)
def test_presets_are_those_of_rclpy(name: str, expected: QoSProfile) -> None:
    assert without_liveliness(rclpy_profile(PRESETS[name])) == without_liveliness(expected)


def test_the_defaults_are_those_of_rclpy() -> None:
    ours, theirs = rclpy_profile(QosProfile()), QoSProfile(depth=10)
    assert without_liveliness(ours) == without_liveliness(theirs)
