"""A publisher whose deadline or lifespan is shorter than its period."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.analysis.timing.rates import timed_publishers
from composer.diagnostics import Diagnostic, warning

_EXAMPLE = """\
system: timing
nodes:
  robot:
    publishers:
      pose: {type: geometry_msgs/msg/Pose, qos: {%s}, external: true}
    timers: {step: {period_ms: 100, publish: {pose: {}}}}
"""

DEADLINE_TOO_SHORT = warning(
    code="RC312",
    name="deadline-too-short",
    summary="A publisher's deadline is shorter than its publishing period.",
    why="Every message is late, and every subscription reports a missed deadline.",
    bad=_EXAMPLE % "deadline_ms: 50",
    good=_EXAMPLE % "deadline_ms: 150",
)
LIFESPAN_TOO_SHORT = warning(
    code="RC313",
    name="lifespan-too-short",
    summary="A publisher's lifespan is shorter than its publishing period.",
    why=(
        "Between an expired message and the next one there is no message: a late joiner or a "
        "slow subscription receives nothing."
    ),
    bad=_EXAMPLE % "lifespan_ms: 50",
    good=_EXAMPLE % "lifespan_ms: 200",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare deadlines and lifespans with the periods of the publishing timers."""
    for endpoint, period_s in context.once(timed_publishers):
        qos, name, period_ms = endpoint.port.qos, endpoint.port.name, period_s * 1000.0
        if not qos.known:
            continue
        deadline_ms, lifespan_ms = qos.profile.deadline_ms, qos.profile.lifespan_ms
        if deadline_ms is not None and deadline_ms < period_ms:
            yield Diagnostic(
                DEADLINE_TOO_SHORT,
                f"publisher '{name}' offers a deadline of {number(deadline_ms)} ms, "
                f"but publishes every {number(period_ms)} ms",
                qos.policy_span("deadline_ms"),
                hint="make the deadline longer than the period, with some margin",
            )
        if lifespan_ms is not None and lifespan_ms < period_ms:
            yield Diagnostic(
                LIFESPAN_TOO_SHORT,
                f"messages of '{name}' expire after {number(lifespan_ms)} ms, "
                f"but are published every {number(period_ms)} ms",
                qos.policy_span("lifespan_ms"),
                hint="make the lifespan longer than the period",
            )
