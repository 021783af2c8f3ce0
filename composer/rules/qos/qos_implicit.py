"""A publisher or subscription without an explicit QoS profile."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.diagnostics import Diagnostic, info
from composer.model import ChannelKind

RULE = info(
    code="RC501",
    name="qos-implicit",
    summary="A publisher or subscription does not set its QoS profile.",
    why=(
        "It gets rclpy's default: reliable, volatile, keep last 10. That suits commands, but "
        "neither sensor streams nor states that late joiners need. An explicit profile shows "
        "that the choice is deliberate."
    ),
    bad="""\
system: implicit
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, external: true}}
""",
    good="""\
system: implicit
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check publishers and subscriptions; services and actions have one usual profile."""
    affected = context.once(earlier_errors).nodes
    for node in context.system.nodes:
        for port in node.ports if node.name.value not in affected else ():
            if port.kind.channel is ChannelKind.TOPIC and not port.qos.explicit:
                yield Diagnostic(
                    RULE,
                    f"{port.kind} '{port.name}' does not set its QoS profile",
                    port.name.span,
                    hint="set 'qos: sensor_data' for streams, 'command' for commands, "
                    "'state' for data that late joiners need",
                )
