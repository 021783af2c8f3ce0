"""A reference to a QoS profile that does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, Rule, Severity, register, suggestion
from composer.qos import PRESETS
from composer.source import Located

RULE = register(
    Rule(
        code="RC205",
        name="unknown-qos-profile",
        severity=Severity.ERROR,
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check every reference to a profile by name."""
    for name in context.once(unknown_profiles):
        hint = (
            "omit 'qos' to use rclpy's defaults, or use 'command', which is the same"
            if name.value == "default"
            else suggestion(name.value, known_profiles(context))
        )
        yield Diagnostic(RULE, f"there is no QoS profile '{name}'", name.span, hint=hint)


def unknown_profiles(context: Context) -> tuple[Located[str], ...]:
    """Return the references to profiles that do not exist."""
    known = known_profiles(context)
    if context.is_partial:
        return ()
    return tuple(
        reference.name
        for reference in context.system.qos_references
        if reference.name.value not in known and not is_unresolved(reference.name.value)
    )


def known_profiles(context: Context) -> frozenset[str]:
    """Return the names of the system's own profiles and of the presets."""
    own = (profile.name.value for profile in context.system.qos_profiles)
    return frozenset((*own, *PRESETS))
