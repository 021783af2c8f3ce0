"""A sensor stream with reliable delivery."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number, port_name
from composer.analysis.timing.rates import rates
from composer.diagnostics import Diagnostic, Label, info
from composer.model import ChannelKind, Port, PortOfNode
from composer.qos import Reliability

RULE = info(
    code="RC317",
    name="reliable-sensor-stream",
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

FAST_HZ = 10.0
_PACKAGE = "sensor_msgs/msg/"
#: Messages of that package that are small, and whose consumers usually request reliable QoS.
_STATES = frozenset({"sensor_msgs/msg/JointState", "sensor_msgs/msg/MultiDOFJointState"})


def check(context: Context) -> Iterator[Diagnostic]:
    """Check publishers of sensor messages with a known rate."""
    known = context.once(rates)
    for channel in context.channels:
        if channel.kind is not ChannelKind.TOPIC:
            continue
        sinks = tuple(end for end in channel.sinks if _is_reliable(end.port))
        for source in channel.sources:
            rate_hz = known.publisher_hz(source) if _is_reliable(source.port) else None
            if _is_stream(source.port.interface.value) and (rate_hz or 0.0) >= FAST_HZ:
                yield _diagnostic(source.port, rate_hz or 0.0, sinks)


def _is_stream(interface: str) -> bool:
    return interface.startswith(_PACKAGE) and interface not in _STATES


def _is_reliable(port: Port) -> bool:
    return port.qos.known and port.qos.profile.reliability is Reliability.RELIABLE


def _diagnostic(port: Port, rate_hz: float, sinks: tuple[PortOfNode, ...]) -> Diagnostic:
    """Report a publisher; if it were best effort, it would not match the reliable ``sinks``."""
    if port.external:
        # Other consumers may request it reliably, and would no longer match.
        hint = "let subscriptions use 'qos: sensor_data'; a reliable publisher serves them too"
    elif sinks:
        hint = "use 'qos: sensor_data' for it and for the subscriptions that request reliable QoS"
    else:
        hint = "use 'qos: sensor_data'"
    return Diagnostic(
        RULE,
        f"sensor data on '{port.full_name}' at {number(rate_hz)} Hz uses reliable QoS",
        port.qos.policy_span("reliability"),
        tuple(
            Label(sink.port.qos.policy_span("reliability"), f"'{port_name(sink)}' requests it")
            for sink in sinks
        ),
        hint,
    )
