"""A chain with a gap."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from composer.analysis.context import Context
from composer.analysis.timing.chains import input_ports
from composer.diagnostics import Diagnostic, Label, error
from composer.model import PortKind

RULE = error(
    code="RC416",
    name="broken-chain",
    summary="A node of a chain does not subscribe to the topic of the previous publisher.",
    why="No data flows through the chain, so its latency is meaningless.",
    bad="""\
system: chain
nodes:
  lidar:
    publishers: {scan: {type: std_msgs/msg/Float64, qos: sensor_data, external: true}}
  brake:
    publishers: {force: {type: std_msgs/msg/Float64, qos: command, external: true}}
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
    """Check each pair of consecutive ports in every chain."""
    system = context.system
    for chain in system.chains:
        for before, after in pairwise(chain.through):
            port, node = system.port(before), system.node(after.node)
            if port is None or port.kind is not PortKind.PUBLISHER:
                continue
            following = system.port(after)
            if node is None or not node.complete or following is None:
                continue
            if following.kind is not PortKind.PUBLISHER:
                continue
            if not any(input_ports(node, port.full_name)):
                yield Diagnostic(
                    RULE,
                    f"node '{node.name}' does not subscribe to '{port.full_name}', "
                    f"which '{before.text}' publishes",
                    after.text.span,
                    (Label(before.text.span, "the previous publisher"),),
                    f"subscribe '{node.name}' to it, or add the missing publishers to the chain",
                )
                break  # further gaps often follow from the first one
