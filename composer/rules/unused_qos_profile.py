"""A QoS profile that nobody uses."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.doubt import doubt
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.rules.unknown_qos_profile import unknown_profiles

RULE = register(
    Rule(
        code="RC242",
        name="unused-qos-profile",
        severity=Severity.INFO,
        summary="A profile of qos_profiles is used by no port, connection or other profile.",
        why="It is left over, or a port that was meant to use it has other QoS than people think.",
        bad="""\
system: profiles
qos_profiles:
  odometry: {extends: sensor_data, depth: 1}
nodes:
  talker: {on_activate: {log: started}}
""",
        good="""\
system: profiles
qos_profiles:
  odometry: {extends: sensor_data, depth: 1}
nodes:
  robot:
    publishers: {odometry: {type: nav_msgs/msg/Odometry, qos: odometry, external: true}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Hold the profiles against their uses."""
    if (
        context.once(doubt).any
        or context.once(unknown_profiles)
        or not all(node.complete for node in context.system.nodes)
    ):
        return  # what is unknown there may be meant for the unused one
    used = {reference.name.value for reference in context.system.qos_references}
    for profile in context.system.qos_profiles:
        if profile.name.value not in used:
            yield Diagnostic(RULE, f"QoS profile '{profile.name}' is never used", profile.name.span)
