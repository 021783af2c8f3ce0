"""QoS profiles by name."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.earlier_errors import earlier_errors
from composer.diagnostics import Diagnostic, Label, error, info, suggestion
from composer.model import ChannelKind, NamedQos
from composer.qos import PRESETS
from composer.source import Located


def known_profiles(context: Context) -> frozenset[str]:
    """Return the names of the system's own profiles and of the presets."""
    own = (profile.name.value for profile in context.system.qos_profiles)
    return frozenset((*own, *PRESETS))


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


UNKNOWN_QOS_PROFILE = error(
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


def check_unknown_qos_profile(context: Context) -> Iterator[Diagnostic]:
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
        yield Diagnostic(
            UNKNOWN_QOS_PROFILE, f"there is no QoS profile '{name}'", name.span, hint=hint
        )


UNUSED_QOS_PROFILE = info(
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


def check_unused_qos_profile(context: Context) -> Iterator[Diagnostic]:
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
            yield Diagnostic(
                UNUSED_QOS_PROFILE, f"QoS profile '{profile.name}' is never used", profile.name.span
            )


QOS_PROFILE_CYCLE = error(
    code="RC318",
    name="qos-profile-cycle",
    summary="QoS profiles extend each other in a cycle.",
    why="None of them has a base to start from.",
    bad="""\
system: profiles
qos_profiles:
  odometry: {extends: pose, depth: 1}
  pose: {extends: odometry, depth: 2}
nodes:
  robot: {on_activate: {log: started}}
""",
    good="""\
system: profiles
qos_profiles:
  odometry: {extends: sensor_data, depth: 1}
  pose: {extends: odometry, depth: 2}
nodes:
  robot:
    publishers: {pose: {type: geometry_msgs/msg/Pose, qos: pose, external: true}}
""",
)


def check_qos_profile_cycle(context: Context) -> Iterator[Diagnostic]:
    """Follow the profiles that each profile extends; report every cycle once."""
    profiles = {profile.name.value: profile for profile in context.system.qos_profiles}
    done: set[str] = set()
    for name in profiles:
        path: dict[str, NamedQos] = {}
        step: str | None = name
        while step is not None and step in profiles and step not in done and step not in path:
            path[step] = profiles[step]
            extends = path[step].extends
            step = extends.value if extends is not None else None
        done.update(path)
        if step is not None and step in path:
            names = list(path)
            yield _profile_cycle([path[item] for item in names[names.index(step) :]])


def _profile_cycle(cycle: list[NamedQos]) -> Diagnostic:
    places = [profile.extends or profile.name for profile in cycle]
    names = [profile.name.value for profile in cycle]
    path = " -> ".join((*names, names[0]))
    message = (
        f"QoS profile '{names[0]}' extends itself"
        if len(cycle) == 1
        else f"QoS profiles extend each other in a cycle: {path}"
    )
    labels = (
        Label(place.span, f"'{name}' extends '{place}'")
        for place, name in zip(places[1:], names[1:], strict=True)
    )
    hint = "extend a preset" if len(cycle) == 1 else "extend a preset in one of them"
    return Diagnostic(QOS_PROFILE_CYCLE, message, places[0].span, tuple(labels), hint)


QOS_IMPLICIT = info(
    code="RC501",
    name="qos-implicit",
    summary="A publisher or subscription does not set its QoS profile.",
    why=(
        "It gets rclpy's default: reliable, volatile, keep last 10. That suits commands, but "
        "neither sensor streams nor states that late joiners need. An explicit profile shows "
        "that the choice is deliberate."
    ),
    bad="""\
system: implicit
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, external: true}}
""",
    good="""\
system: implicit
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
""",
)


def check_qos_implicit(context: Context) -> Iterator[Diagnostic]:
    """Check publishers and subscriptions; services and actions have one usual profile."""
    affected = context.once(earlier_errors).nodes
    for node in context.system.nodes:
        for port in node.ports if node.name.value not in affected else ():
            if port.kind.channel is ChannelKind.TOPIC and not port.qos.explicit:
                yield Diagnostic(
                    QOS_IMPLICIT,
                    f"{port.kind} '{port.name}' does not set its QoS profile",
                    port.name.span,
                    hint="set 'qos: sensor_data' for streams, 'command' for commands, "
                    "'state' for data that late joiners need",
                )
