"""A chain that cannot meet its latency."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.analysis.timing.chains import ChainDelay, chain_delays
from composer.diagnostics import Diagnostic, Label, error

RULE = error(
    code="RC415",
    name="latency-budget",
    summary="The periods and budgets along a chain add up to more than its latency.",
    why=(
        "A node that publishes from a timer delays its input by up to one period. No "
        "processor can make up for delays that the periods cause."
    ),
    bad="""\
system: chain
nodes:
  lidar:
    publishers: {scan: {type: std_msgs/msg/Float64, qos: sensor_data}}
  brake:
    state: {distance: 0.0}
    subscriptions:
      scan: {type: std_msgs/msg/Float64, qos: sensor_data, set: {distance: "{message.data}"}}
    publishers: {force: {type: std_msgs/msg/Float64, qos: command, external: true}}
    timers: {step: {period_ms: 100, publish: {force: {data: "{state.distance}"}}}}
chains:
  stop: {through: [lidar.scan, brake.force], latency_ms: 50}
""",
    good="""\
system: chain
nodes:
  lidar:
    publishers: {scan: {type: std_msgs/msg/Float64, qos: sensor_data}}
  brake:
    subscriptions:
      scan: {type: std_msgs/msg/Float64, qos: sensor_data, publish: {force: "{message}"}}
    publishers: {force: {type: std_msgs/msg/Float64, qos: command, external: true}}
chains:
  stop: {through: [lidar.scan, brake.force], latency_ms: 50}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Add up the delays along every chain."""
    for chain in context.system.chains:
        found = list(chain_delays(context, chain))
        total_ms = sum(delay.milliseconds for delay in found)
        if total_ms > chain.latency_ms.value:
            yield Diagnostic(
                RULE,
                f"chain '{chain.name}' may take {number(total_ms)} ms, "
                f"more than its latency of {number(chain.latency_ms.value)} ms",
                chain.latency_ms.span,
                tuple(
                    Label(delay.span, f"{delay.what} {number(delay.milliseconds)} ms")
                    for delay in found
                ),
                _hint(found),
            )


def _hint(delays: Iterable[ChainDelay]) -> str:
    """Return a hint about what the delays are: periods of timers, budgets, or both."""
    kinds = {delay.is_period for delay in delays}
    if kinds == {True}:
        return "publish from the subscription, or use shorter timer periods"
    if kinds == {False}:
        return "use shorter budgets, or allow a higher latency"
    return "publish from the subscription, or use shorter timer periods or budgets"
