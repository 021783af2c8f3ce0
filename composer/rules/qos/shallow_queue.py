"""A reliable topic that can still lose messages."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.analysis.timing.rates import rates
from composer.diagnostics import Diagnostic, warning
from composer.model import ChannelKind
from composer.qos import Durability, History, QosProfile, Reliability

RULE = warning(
    code="RC315",
    name="shallow-queue",
    summary="A reliable topic with a high rate has a queue depth of 1.",
    why=(
        "Reliable delivery loses no message in transit, but a queue of depth 1 replaces each "
        "message that is not taken before the next one arrives. If only the latest value "
        "matters, use best effort or transient local."
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

#: In hertz; on slower topics a message is taken before the next one arrives.
FAST_HZ = 10.0


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the publishers and subscriptions of topics with a known rate."""
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
                    "has a queue depth of 1",
                    port.qos.policy_span("depth"),
                    hint="use a depth of 10, or best effort",
                )


def _is_shallow(profile: QosProfile) -> bool:
    return (
        profile.depth == 1
        and profile.history is History.KEEP_LAST
        and profile.reliability is Reliability.RELIABLE
        and profile.durability is Durability.VOLATILE
    )
