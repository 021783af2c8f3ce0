"""QoS presets and the rule of offer and request. tests/ros holds the rule against rclpy."""

from __future__ import annotations

from dataclasses import fields, replace

import pytest

from composer.model.qos import (
    PRESETS,
    Durability,
    History,
    Incompatibility,
    Liveliness,
    QosProfile,
    Reliability,
    incompatibilities,
)

WEAK = QosProfile(
    reliability=Reliability.BEST_EFFORT,
    durability=Durability.VOLATILE,
    liveliness=Liveliness.AUTOMATIC,
)
STRONG = QosProfile(
    reliability=Reliability.RELIABLE,
    durability=Durability.TRANSIENT_LOCAL,
    deadline_ms=10.0,
    liveliness=Liveliness.MANUAL_BY_TOPIC,
    liveliness_lease_duration_ms=100.0,
)


def test_a_strong_offer_meets_every_request() -> None:
    assert incompatibilities(STRONG, WEAK) == ()
    assert incompatibilities(STRONG, STRONG) == ()


def test_every_policy_that_is_too_weak_is_named() -> None:
    assert incompatibilities(WEAK, STRONG) == (
        Incompatibility(
            "reliability",
            "best_effort",
            "reliable",
            "the publisher does not send lost messages again",
        ),
        Incompatibility(
            "durability",
            "volatile",
            "transient_local",
            "the publisher does not keep messages for late joiners",
        ),
        Incompatibility(
            "deadline_ms",
            "no limit",
            "10 ms",
            "the publisher offers a longer deadline than the subscription requests",
        ),
        Incompatibility(
            "liveliness",
            "automatic",
            "manual_by_topic",
            "the publisher does not assert its liveliness manually",
        ),
        Incompatibility(
            "liveliness_lease_duration_ms",
            "no limit",
            "100 ms",
            "the publisher may be silent for longer than the subscription allows",
        ),
    )


@pytest.mark.parametrize("policy", ["deadline_ms", "liveliness_lease_duration_ms"])
@pytest.mark.parametrize(
    ("offered", "requested", "fits"),
    [(10.0, 10.0, True), (10.0, 20.0, True), (20.0, 10.0, False), (5.0, None, True)],
)
def test_a_period_offered_must_not_be_longer(
    policy: str, offered: float | None, requested: float | None, fits: bool
) -> None:
    found = incompatibilities(
        replace(WEAK, **{policy: offered}), replace(WEAK, **{policy: requested})
    )
    assert [item.policy for item in found] == ([] if fits else [policy])


def test_history_depth_and_lifespan_never_matter() -> None:
    odd = replace(WEAK, history=History.KEEP_ALL, depth=1, lifespan_ms=1.0)
    assert incompatibilities(odd, WEAK) == incompatibilities(WEAK, odd) == ()


def test_the_three_patterns() -> None:
    sensor_data, command, state = (PRESETS[name] for name in ("sensor_data", "command", "state"))
    assert (sensor_data.reliability, sensor_data.depth) == (Reliability.BEST_EFFORT, 5)
    assert (command.reliability, command.depth) == (Reliability.RELIABLE, 10)
    assert (state.durability, state.depth) == (Durability.TRANSIENT_LOCAL, 1)


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_compatible_with_itself(name: str) -> None:
    assert incompatibilities(PRESETS[name], PRESETS[name]) == ()


def test_policies_are_named_as_in_yaml() -> None:
    assert {item.policy for item in incompatibilities(WEAK, STRONG)} <= {
        policy.name for policy in fields(QosProfile)
    }
