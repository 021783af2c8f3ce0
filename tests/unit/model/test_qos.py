"""QoS presets and the rule of offer and request. tests/ros holds the rule against rclpy."""

from __future__ import annotations

from dataclasses import fields

from composer.model.qos import (
    PRESETS,
    Durability,
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
