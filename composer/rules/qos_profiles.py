"""QoS profiles by name."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, errors_subject, info, suggestion
from composer.base.source import Located
from composer.language.rules import CYCLE, UNUSED_DECLARATION
from composer.model import ChannelKind, NamedQos
from composer.model.qos import PRESETS
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.earlier_errors import earlier_errors
from composer.rules.analysis.subjects import unknown_subjects
from composer.rules.references import UNDECLARED_NAME

QOS_IMPLICIT = info("RC501", "qos-implicit")


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
            UNDECLARED_NAME,
            f"there is no QoS profile '{name}'",
            name.span,
            hint=hint,
            subjects=unknown_subjects("QoS profile", name.value, known_profiles(context)),
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
                UNUSED_DECLARATION,
                f"QoS profile '{profile.name}' is never used",
                profile.name.span,
                relies_on=(errors_subject(profile.name.span),),
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
    return Diagnostic(CYCLE, message, places[0].span, tuple(labels), hint)


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
