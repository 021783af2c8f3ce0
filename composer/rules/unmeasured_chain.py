"""A chain through a node of another process."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC477",
        name="unmeasured-chain",
        severity=Severity.WARNING,
        summary="A chain passes through an executable or external node.",
        why=(
            "The latency of a chain is measured in the process of the system. What another process "
            "makes of a message cannot be followed, so the chain is checked statically only."
        ),
        bad="""\
system: brake
nodes:
  lidar:
    external: true
    publishers: {scan: {type: std_msgs/msg/String, qos: sensor_data}}
  brake:
    subscriptions:
      scan: {type: std_msgs/msg/String, qos: sensor_data, publish: {commands: {data: stop}}}
    publishers: {commands: {type: std_msgs/msg/String, qos: command, external: true}}
chains:
  stop: {through: [lidar.scan, brake.commands], latency_ms: 50}
""",
        good="""\
system: brake
nodes:
  lidar:
    timers: {tick: {period_ms: 20, publish: {scan: {data: near}}}}
    publishers: {scan: {type: std_msgs/msg/String, qos: sensor_data}}
  brake:
    subscriptions:
      scan: {type: std_msgs/msg/String, qos: sensor_data, publish: {commands: {data: stop}}}
    publishers: {commands: {type: std_msgs/msg/String, qos: command, external: true}}
chains:
  stop: {through: [lidar.scan, brake.commands], latency_ms: 50}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the publishers of the chains."""
    for chain in context.system.chains:
        for endpoint in chain.through:
            node = context.system.node(endpoint.node)
            if node is None or node.in_process:
                continue
            yield Diagnostic(
                RULE,
                f"the latency of chain '{chain.name}' is not measured: '{node.name}' runs in "
                "another process",
                endpoint.text.span,
            )
            break
