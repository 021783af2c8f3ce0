"""A message that is gone before the next one comes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.rates import timed_publishers
from composer.analysis.words import number
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC313",
        name="lifespan-too-short",
        severity=Severity.WARNING,
        summary="A publisher's lifespan is shorter than the period it publishes with.",
        why=(
            "Between two messages there is none: who joins then, or takes its messages a little "
            "late, gets nothing."
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Hold lifespans against the periods that timers publish with."""
    for end, period_s in context.once(timed_publishers):
        qos = end.port.qos
        lifespan_ms = qos.profile.lifespan_ms
        if qos.known and lifespan_ms is not None and lifespan_ms < period_s * 1000.0:
            yield Diagnostic(
                RULE,
                f"messages of '{end.port.name}' live {number(lifespan_ms)} ms, "
                f"but the next one comes after {number(period_s * 1000.0)} ms",
                qos.policy_span("lifespan_ms"),
                hint="let them live longer than the period",
            )
