"""A QoS profile that is not used."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.analysis.endpoints.references import unknown_profiles
from composer.diagnostics import Diagnostic, info

RULE = info(
    code="RC242",
    name="unused-qos-profile",
    summary="A declared QoS profile is not used by any port, connection or other profile.",
    why=(
        "The profile is left over, or a port that should use it has a different QoS profile "
        "than intended."
    ),
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the profiles with the references to them."""
    if (
        context.once(earlier_errors).any
        or context.once(unknown_profiles)
        or not all(node.complete for node in context.system.nodes)
    ):
        return  # an unknown name may be a misspelling of the unused one
    used = {reference.name.value for reference in context.system.qos_references}
    for profile in context.system.qos_profiles:
        if profile.name.value not in used:
            yield Diagnostic(RULE, f"QoS profile '{profile.name}' is never used", profile.name.span)
