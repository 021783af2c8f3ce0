"""A reference to a QoS profile that does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.endpoints.references import known_profiles, unknown_profiles
from composer.diagnostics import Diagnostic, error, suggestion

RULE = error(
    code="RC205",
    name="unknown-qos-profile",
    summary="A QoS profile is neither declared under qos_profiles nor a preset.",
    why=(
        "Falling back to another profile could create endpoints that never match, without an "
        "error at run time."
    ),
    bad="""\
system: profile
nodes:
  talker:
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_dada, external: true}}
""",
    good="""\
system: profile
nodes:
  talker:
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, external: true}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check every reference to a profile by name.

    The systems that use a node type may declare the profiles that it names.
    """
    if context.system.node_type:
        return
    for name in context.once(unknown_profiles):
        hint = (
            "omit 'qos' to use rclpy's defaults, or use 'command', which is the same"
            if name.value == "default"
            else suggestion(name.value, known_profiles(context))
        )
        yield Diagnostic(RULE, f"there is no QoS profile '{name}'", name.span, hint=hint)
