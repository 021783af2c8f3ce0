"""A restart policy of an external node."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import OnFailure

RULE = register(
    Rule(
        code="RC476",
        name="external-restart",
        severity=Severity.WARNING,
        summary="An external node is to be restarted.",
        why=(
            "The system does not start external nodes, so it cannot restart them. A node that "
            "disappears is awaited with any policy but shutdown; each restart only limits how "
            "often."
        ),
        bad="""\
system: lidar
nodes:
  lidar:
    external: true
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, external: true}}
    lifecycle: {on_failure: restart}
""",
        good="""\
system: lidar
nodes:
  lidar:
    external: true
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, external: true}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the policies that external nodes set themselves."""
    system = context.system
    for node in system.nodes:
        policy = node.supervision.on_failure
        if node.external is None or policy is None or policy is system.supervision.on_failure:
            continue
        if policy.value is OnFailure.RESTART:
            yield Diagnostic(
                RULE,
                f"external node '{node.name}' cannot be restarted",
                policy.span,
                hint="remove it: with 'isolate', the node is used again once it is there again",
            )
