"""A topic end that leaves its QoS to the default."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.doubt import doubt
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import ChannelKind

RULE = register(
    Rule(
        code="RC501",
        name="qos-implicit",
        severity=Severity.INFO,
        summary="A publisher or subscription does not say its QoS.",
        why=(
            "It gets rclpy's default: reliable, volatile, the last 10. That is right for orders "
            "and wrong for sensor streams and for states that late joiners need. Who reads the "
            "file should see that the choice was made."
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at the ends of topics; services and actions have one usual profile."""
    suspects = context.once(doubt).nodes
    for node in context.system.nodes:
        for port in node.ports if node.name.value not in suspects else ():
            if port.kind.channel is ChannelKind.TOPIC and not port.qos.explicit:
                yield Diagnostic(
                    RULE,
                    f"{port.kind} '{port.name}' leaves its QoS implicit",
                    port.name.span,
                    hint="say 'qos: sensor_data' for a stream, 'command' for orders, "
                    "'state' for what late joiners need",
                )
