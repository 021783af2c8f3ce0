"""A service that is asked again and again."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.words import number
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import PortKind

RULE = register(
    Rule(
        code="RC331",
        name="polled-service",
        severity=Severity.INFO,
        summary="A timer calls a service more often than once a second.",
        why=(
            "A service answers a question now and then. What is asked for all the time is a "
            "stream: as a topic it costs half the messages, and nobody waits."
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
      battery: {type: sensor_msgs/msg/BatteryState, qos: state, external: true, log: heard}
""",
    )
)

SHORTEST_S = 1.0


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at the calls that timers make unconditionally."""
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
                    (Label(timer.period.span, "this often"),),
                    "let the server publish a topic",
                )
