"""A publisher whose deadline is shorter than its period."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.analysis.timing.rates import timed_publishers
from composer.diagnostics import Diagnostic, warning

RULE = warning(
    code="RC312",
    name="deadline-too-short",
    summary="A publisher's deadline is shorter than its publishing period.",
    why="Every message is late, and every subscription reports a missed deadline.",
    bad="""\
system: deadline
nodes:
  robot:
    publishers:
      pose: {type: geometry_msgs/msg/Pose, qos: {deadline_ms: 50}, external: true}
    timers: {step: {period_ms: 100, publish: {pose: {}}}}
""",
    good="""\
system: deadline
nodes:
  robot:
    publishers:
      pose: {type: geometry_msgs/msg/Pose, qos: {deadline_ms: 150}, external: true}
    timers: {step: {period_ms: 100, publish: {pose: {}}}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare offered deadlines with the periods of the publishing timers."""
    for endpoint, period_s in context.once(timed_publishers):
        qos = endpoint.port.qos
        deadline_ms = qos.profile.deadline_ms
        if qos.known and deadline_ms is not None and deadline_ms < period_s * 1000.0:
            yield Diagnostic(
                RULE,
                f"publisher '{endpoint.port.name}' offers a deadline of {number(deadline_ms)} ms, "
                f"but publishes every {number(period_s * 1000.0)} ms",
                qos.policy_span("deadline_ms"),
                hint="make the deadline longer than the period, with some margin",
            )
