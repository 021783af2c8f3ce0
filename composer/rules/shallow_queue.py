"""A reliable topic that loses messages after all."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.rates import rates
from composer.analysis.words import number
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import ChannelKind
from composer.qos import Durability, History, QosProfile, Reliability

RULE = register(
    Rule(
        code="RC315",
        name="shallow-queue",
        severity=Severity.WARNING,
        summary="A fast reliable topic has a depth of 1.",
        why=(
            "Reliable means that nothing is lost on the way, but with room for one message the "
            "next one replaces it before it is taken. For the latest value only, say so: "
            "best effort, or transient local."
        ),
        bad="""\
system: queues
nodes:
  robot:
    publishers:
      order: {type: std_msgs/msg/String, qos: {extends: command, depth: 1}, external: true}
    timers: {step: {rate_hz: 50, publish: {order: {data: go}}}}
""",
        good="""\
system: queues
nodes:
  robot:
    publishers:
      order: {type: std_msgs/msg/String, qos: {extends: command, depth: 10}, external: true}
    timers: {step: {rate_hz: 50, publish: {order: {data: go}}}}
""",
    )
)

#: In hertz: on a slower topic a message is taken before the next one comes.
FAST_HZ = 10.0


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at the ends of topics whose rate is known."""
    known = context.once(rates)
    for node in context.system.nodes:
        for port in node.ports:
            if port.kind.channel is not ChannelKind.TOPIC or not port.qos.known:
                continue
            rate_hz = known.topic_hz(port.full_name) if _is_shallow(port.qos.profile) else None
            if rate_hz is not None and rate_hz >= FAST_HZ:
                yield Diagnostic(
                    RULE,
                    f"reliable topic '{port.full_name}' at {number(rate_hz)} Hz "
                    "has room for one message only",
                    port.qos.policy_span("depth"),
                    hint="give it a depth of 10, or make it best effort",
                )


def _is_shallow(profile: QosProfile) -> bool:
    return (
        profile.depth == 1
        and profile.history is History.KEEP_LAST
        and profile.reliability is Reliability.RELIABLE
        and profile.durability is Durability.VOLATILE
    )
