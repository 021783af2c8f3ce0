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
    for profile in PRESETS.values():
        assert incompatibilities(profile, profile) == ()
    # History, depth and lifespan never matter.
    odd = replace(WEAK, history=History.KEEP_ALL, depth=1, lifespan_ms=1.0)
    assert incompatibilities(odd, WEAK) == incompatibilities(WEAK, odd) == ()


#: Policies as they are named in YAML; what is offered and requested; the consequence.
TOO_WEAK = (
    ("reliability", "best_effort", "reliable", "does not send lost messages again"),
    ("durability", "volatile", "transient_local", "does not keep messages for late joiners"),
    ("deadline_ms", "no limit", "10 ms",
     "offers a longer deadline than the subscription requests"),
    ("liveliness", "automatic", "manual_by_topic", "does not assert its liveliness manually"),
    ("liveliness_lease_duration_ms", "no limit", "100 ms",
     "may be silent for longer than the subscription allows"),
)  # fmt: skip


def test_every_policy_that_is_too_weak_is_named() -> None:
    assert incompatibilities(WEAK, STRONG) == tuple(
        Incompatibility(*case, f"the publisher {consequence}") for *case, consequence in TOO_WEAK
    )
    assert {name for name, *_ in TOO_WEAK} <= {policy.name for policy in fields(QosProfile)}


def test_the_three_patterns() -> None:
    sensor_data, command, state = (PRESETS[name] for name in ("sensor_data", "command", "state"))
    assert (sensor_data.reliability, sensor_data.depth) == (Reliability.BEST_EFFORT, 5)
    assert (command.reliability, command.depth) == (Reliability.RELIABLE, 10)
    assert (state.durability, state.depth) == (Durability.TRANSIENT_LOCAL, 1)


@pytest.mark.parametrize("policy", ["deadline_ms", "liveliness_lease_duration_ms"])
@pytest.mark.parametrize(
    ("offered", "requested", "fits"),
    [(10.0, 10.0, True), (10.0, 20.0, True), (20.0, 10.0, False), (5.0, None, True)],
)
def test_periods(policy: str, offered: float | None, requested: float | None, fits: bool) -> None:
    found = incompatibilities(
        replace(WEAK, **{policy: offered}), replace(WEAK, **{policy: requested})
    )
    assert [item.policy for item in found] == ([] if fits else [policy])
