"""``composer.model.qos`` against rclpy: all combinations of policies, presets, and overrides."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.duration import Duration
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.publisher import Publisher
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
    qos_profile_parameters,
    qos_profile_sensor_data,
    qos_profile_services_default,
)
from rclpy.qos_overriding_options import QoSOverridingOptions, _get_allowed_policies
from rclpy.subscription import Subscription
from std_msgs.msg import String

from composer.model import PortKind
from composer.model.qos import (
    PRESETS,
    Durability,
    History,
    Liveliness,
    QosProfile,
    Reliability,
    incompatibilities,
)
from composer.model.qos_overrides import overridable_policies
from tests.ros.support.in_process import Peer, running, wait_until

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


#: Not supported here: all topics are topics of ROS. INVALID stands for none.
LEFT_OUT = {QoSPolicyKind.AVOID_ROS_NAMESPACE_CONVENTIONS, QoSPolicyKind.INVALID}
VALUES = {
    "history": "keep_all",
    "depth": 4,
    "reliability": "best_effort",
    "durability": "transient_local",
    "deadline": 2_500_000_000,
    "lifespan": 3_000_000_000,
    "liveliness": "manual_by_topic",
    "liveliness_lease_duration": 4_000_000_000,
}
SYSTEM = """
system: overridden
nodes:
  ours:
    parameters: {{{parameters}}}
    publishers: {{words: {{type: std_msgs/msg/String, external: true}}}}
    subscriptions: {{words_in: {{type: std_msgs/msg/String, topic: words, external: true}}}}
"""


def given() -> dict[str, Any]:
    return {
        f"qos_overrides./words.{kind}.{policy}": VALUES[policy]
        for kind in (PortKind.PUBLISHER, PortKind.SUBSCRIPTION)
        for policy in overridable_policies(kind)
    }


def theirs(peer: Peer) -> None:
    """Create the same endpoints with rclpy, in the node of the peer."""
    node = peer.node
    node._parameter_overrides = {name: Parameter(name, value=v) for name, v in given().items()}
    options = QoSOverridingOptions([kind for kind in QoSPolicyKind if kind not in LEFT_OUT])
    node.create_publisher(String, "words", 10, qos_overriding_options=options)
    node.create_subscription(String, "words", print, 10, qos_overriding_options=options)


@pytest.mark.parametrize(
    ("kind", "entity"), [(PortKind.PUBLISHER, Publisher), (PortKind.SUBSCRIPTION, Subscription)]
)
def test_the_policies_are_those_of_rclpy(kind: PortKind, entity: Any) -> None:
    allowed = _get_allowed_policies(entity)
    names = {policy.name.lower() for policy in allowed if policy not in LEFT_OUT}
    assert set(overridable_policies(kind)) == names


def test_all_policies_are_overridden_as_by_rclpy(tmp_path: Path, peer: Peer) -> None:
    theirs(peer)
    parameters = ", ".join(f"{name}: {value}" for name, value in given().items())
    with running(SYSTEM.format(parameters=parameters), tmp_path):
        node = peer.node
        wait_until(lambda: node.count_publishers("/words") == 2)
        wait_until(lambda: node.count_subscribers("/words") == 2)
        for ends in (
            node.get_publishers_info_by_topic("/words"),
            node.get_subscriptions_info_by_topic("/words"),
        ):
            first, second = (end.qos_profile for end in ends)
            assert first == second
        listed = peer.call(ListParameters, "/ours/list_parameters").result.names
        names = [name for name in listed if name.startswith("qos_overrides.")]
        request = GetParameters.Request(names=names)
        values = peer.call(GetParameters, "/ours/get_parameters", request).values
    assert dict(zip(names, map(parameter_value_to_python, values), strict=True)) == given()
