"""A sensor stream with reliable delivery."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.analysis.rates import rates
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import PortKind, PortOfNode
from composer.qos import Reliability

RULE = register(
    Rule(
        code="RC317",
        name="reliable-sensor-stream",
        severity=Severity.INFO,
        summary="High-rate sensor data is published reliably.",
        why=(
            "Resending a lost image delays all that follow, and the old image is no longer "
            "needed. The 'sensor_data' preset is best effort."
        ),
        bad="""\
system: stream
nodes:
  camera:
    publishers: {image: {type: sensor_msgs/msg/Image, qos: command, external: true}}
    timers: {frame: {rate_hz: 30, publish: {image: {}}}}
""",
        good="""\
system: stream
nodes:
  camera:
    publishers: {image: {type: sensor_msgs/msg/Image, qos: sensor_data, external: true}}
    timers: {frame: {rate_hz: 30, publish: {image: {}}}}
""",
    )
)

FAST_HZ = 10.0
_PACKAGE = "sensor_msgs/msg/"


def check(context: Context) -> Iterator[Diagnostic]:
    """Check publishers of sensor messages with a known rate."""
    known = context.once(rates)
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.PUBLISHER):
            if not port.interface.value.startswith(_PACKAGE) or not port.qos.known:
                continue
            rate_hz = known.publisher_hz(PortOfNode(node, port))
            if rate_hz is None or rate_hz < FAST_HZ:
                continue
            if port.qos.profile.reliability is Reliability.RELIABLE:
                yield Diagnostic(
                    RULE,
                    f"sensor data on '{port.full_name}' at {number(rate_hz)} Hz uses reliable QoS",
                    port.qos.policy_span("reliability"),
                    hint="use 'qos: sensor_data'",
                )
