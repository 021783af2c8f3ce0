"""QoS profiles that extend each other."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, error
from composer.model import NamedQos

RULE = error(
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


def check(context: Context) -> Iterator[Diagnostic]:
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
            yield _diagnostic([path[item] for item in names[names.index(step) :]])


def _diagnostic(cycle: list[NamedQos]) -> Diagnostic:
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
    return Diagnostic(RULE, message, places[0].span, tuple(labels), hint)
