"""A sensor stream that waits for what is lost."""

from __future__ import annotations

from collections.abc import Iterator

from composer.checks.context import Context
from composer.checks.publishing import timed_publishers
from composer.checks.words import number
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.qos import Reliability

RULE = register(
    Rule(
        code="RC317",
        name="reliable-sensor-stream",
        severity=Severity.INFO,
        summary="Fast sensor data is sent reliably.",
        why=(
            "Sending a lost image again delays all that come after it, and nobody needs the old "
            "one. The preset 'sensor_data' is best effort."
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

FAST_S = 0.1
_PACKAGE = "sensor_msgs/msg/"


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at publishers of sensor messages whose rate is known."""
    for end, period_s in context.once(timed_publishers):
        port = end.port
        if not port.interface.value.startswith(_PACKAGE) or period_s > FAST_S:
            continue
        if port.qos.known and port.qos.profile.reliability is Reliability.RELIABLE:
            yield Diagnostic(
                RULE,
                f"sensor data on '{port.full_name}' at {number(1 / period_s)} Hz is sent reliably",
                port.qos.policy_span("reliability"),
                hint="use 'qos: sensor_data'",
            )
