"""A message that expires before the next one is published."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.analysis.timing.rates import timed_publishers
from composer.diagnostics import Diagnostic, warning

RULE = warning(
    code="RC313",
    name="lifespan-too-short",
    summary="A publisher's lifespan is shorter than its publishing period.",
    why=(
        "Between an expired message and the next one there is no message: a late joiner or a "
        "slow subscription receives nothing."
    ),
    bad="""\
system: lifespan
nodes:
  robot:
    publishers:
      pose: {type: geometry_msgs/msg/Pose, qos: {lifespan_ms: 50}, external: true}
    timers: {step: {period_ms: 100, publish: {pose: {}}}}
""",
    good="""\
system: lifespan
nodes:
  robot:
    publishers:
      pose: {type: geometry_msgs/msg/Pose, qos: {lifespan_ms: 200}, external: true}
    timers: {step: {period_ms: 100, publish: {pose: {}}}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare lifespans with the periods of the publishing timers."""
    for endpoint, period_s in context.once(timed_publishers):
        qos = endpoint.port.qos
        lifespan_ms = qos.profile.lifespan_ms
        if qos.known and lifespan_ms is not None and lifespan_ms < period_s * 1000.0:
            yield Diagnostic(
                RULE,
                f"messages of '{endpoint.port.name}' expire after {number(lifespan_ms)} ms, "
                f"but are published every {number(period_s * 1000.0)} ms",
                qos.policy_span("lifespan_ms"),
                hint="make the lifespan longer than the period",
            )
