"""A liveliness lease that ends before the next message."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.analysis.timing.rates import timed_publishers
from composer.diagnostics import Diagnostic, warning
from composer.qos import Liveliness

RULE = warning(
    code="RC319",
    name="lease-too-short",
    summary="A publisher's liveliness lease is shorter than its publishing period.",
    why=(
        "With 'liveliness: manual_by_topic', each message renews the lease. If it ends "
        "before the next message, every subscription reports that the publisher is not "
        "alive."
    ),
    bad="""\
system: liveliness
nodes:
  robot:
    publishers:
      pose:
        type: geometry_msgs/msg/Pose
        qos: {liveliness: manual_by_topic, liveliness_lease_duration_ms: 50}
        external: true
    timers: {step: {period_ms: 100, publish: {pose: {}}}}
""",
    good="""\
system: liveliness
nodes:
  robot:
    publishers:
      pose:
        type: geometry_msgs/msg/Pose
        qos: {liveliness: manual_by_topic, liveliness_lease_duration_ms: 300}
        external: true
    timers: {step: {period_ms: 100, publish: {pose: {}}}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the leases that messages renew with the periods of the publishing timers."""
    for endpoint, period_s in context.once(timed_publishers):
        qos = endpoint.port.qos
        lease_ms = qos.profile.liveliness_lease_duration_ms
        is_manual = qos.profile.liveliness is Liveliness.MANUAL_BY_TOPIC
        if qos.known and is_manual and lease_ms is not None and lease_ms < period_s * 1000.0:
            yield Diagnostic(
                RULE,
                f"the lease of publisher '{endpoint.port.name}' ends after {number(lease_ms)} ms, "
                f"but it publishes every {number(period_s * 1000.0)} ms",
                qos.policy_span("liveliness_lease_duration_ms"),
                hint="make the lease longer than the period, with some margin",
            )
