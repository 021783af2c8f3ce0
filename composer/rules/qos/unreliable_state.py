"""A transient-local endpoint that is best effort."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, info
from composer.model import ChannelKind
from composer.qos import Durability, QosProfile, Reliability

RULE = info(
    code="RC532",
    name="unreliable-state",
    summary="A publisher or subscription is transient local, but best effort.",
    why=(
        "Messages from before a subscription existed are sent to it as lost ones are: again. "
        "Best effort sends nothing again, so late joiners do not get the last message. PX4 "
        "uses both by convention, and a node that communicates with it may have to."
    ),
    bad="""\
system: state
nodes:
  robot:
    publishers:
      mode:
        type: std_msgs/msg/String
        qos: {durability: transient_local, reliability: best_effort}
        external: true
""",
    good="""\
system: state
nodes:
  robot:
    publishers:
      mode:
        type: std_msgs/msg/String
        qos: {durability: transient_local, reliability: reliable}
        external: true
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the QoS that nodes set; a shared profile is reported once."""
    for node in context.system.nodes:
        if not node.implementation.declares_everything:
            continue  # its QoS is only described
        for port in node.ports:
            qos = port.qos
            if port.kind.channel is ChannelKind.TOPIC and qos.known and _is_lost(qos.profile):
                yield Diagnostic(
                    RULE,
                    "with 'best_effort', late joiners get nothing in spite of 'transient_local'",
                    qos.policy_span("reliability"),
                    hint="use 'reliable' or 'volatile', unless an external node requires both",
                )


def _is_lost(profile: QosProfile) -> bool:
    return (profile.durability, profile.reliability) == (
        Durability.TRANSIENT_LOCAL,
        Reliability.BEST_EFFORT,
    )
