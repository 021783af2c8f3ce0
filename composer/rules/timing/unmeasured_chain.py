"""A chain through nodes of several processes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, warning
from composer.model import PortKind

RULE = warning(
    code="RC477",
    name="unmeasured-chain",
    summary="A chain passes through an executable or external node, or several processes.",
    why=(
        "The latency of a chain is measured within one process of the system. What another one "
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the publishers of the chains."""
    for chain in context.system.chains:
        ports = map(context.system.port, chain.through)
        if any(port is None or port.kind is not PortKind.PUBLISHER for port in ports):
            continue  # other rules report these
        nodes = ((endpoint, context.system.node(endpoint.node)) for endpoint in chain.through)
        known = [(endpoint, node) for endpoint, node in nodes if node is not None]
        for endpoint, node in known:
            if node.implementation.in_process and node.process == known[0][1].process:
                continue
            yield Diagnostic(
                RULE,
                f"the latency of chain '{chain.name}' is not measured: '{node.name}' runs in "
                "another process",
                endpoint.text.span,
            )
            break
