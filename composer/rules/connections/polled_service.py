"""A service that a timer polls."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.diagnostics import Diagnostic, Label, info
from composer.model import PortKind

RULE = info(
    code="RC331",
    name="polled-service",
    summary="A timer calls a service more often than once a second.",
    why=(
        "Services are for occasional requests. For data that is needed continuously, a topic "
        "uses half the messages, and no client has to wait."
    ),
    bad="""\
system: polling
nodes:
  display:
    clients: {battery: {type: std_srvs/srv/Trigger, external: true}}
    timers: {ask: {rate_hz: 10, call: {battery: {}}}}
""",
    good="""\
system: polling
nodes:
  display:
    subscriptions:
      battery: {type: sensor_msgs/msg/BatteryState, qos: state, external: true, log: received}
""",
)

SHORTEST_S = 1.0


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the calls that timers make unconditionally."""
    for node in context.system.nodes:
        for timer in node.timers:
            period_s = node.period_s(timer)
            if timer.reaction is None or timer.reaction.when is not None or period_s is None:
                continue
            for send in timer.reaction.call:
                port = node.port(send.port.value)
                if port is None or port.kind is not PortKind.CLIENT or period_s >= SHORTEST_S:
                    continue
                yield Diagnostic(
                    RULE,
                    f"timer '{timer.name}' calls service '{port.full_name}' "
                    f"{number(1 / period_s)} times a second",
                    send.port.span,
                    (Label(timer.period.span, "the timer's period"),),
                    "publish the data on a topic instead",
                )
