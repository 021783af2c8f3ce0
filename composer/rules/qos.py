"""QoS profiles, and QoS that does not suit what is published."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice

from composer.base.diagnostics import Diagnostic, Label, errors_subject, info, suggestion, warning
from composer.base.graphs import cycles
from composer.base.source import Located
from composer.language.rules import UNUSED_DECLARATION
from composer.model import ChannelKind, Port, PortKind, PortOfNode
from composer.model.qos import PRESETS, Durability, History, Liveliness, QosProfile, Reliability
from composer.rules.analysis.context import Context, is_unresolved, limited
from composer.rules.analysis.formatting import cycle_of, number, port_name
from composer.rules.analysis.rates import rates, timed_publishers
from composer.rules.analysis.subjects import earlier_errors, unknown_subjects
from composer.rules.references import UNDECLARED_NAME

QOS_IMPLICIT = info("RC501", "qos-implicit")
QOS_DURATION_TOO_SHORT = warning("RC312", "qos-duration-too-short")
UNSUITED_QOS = info("RC314", "unsuited-qos")
#: In hertz; on slower topics a message is taken before the next one arrives.
FAST_HZ = 10.0
_SHOWN_SINKS = 3
#: What is wrong if a duration of a publisher is shorter than its period, and a hint.
_TOO_SHORT = {
    "liveliness_lease_duration_ms": (
        "the lease of publisher '{}' ends after {} ms, but it publishes every {} ms",
        "make the lease longer than the period, with some margin",
    ),
    "deadline_ms": (
        "publisher '{}' offers a deadline of {} ms, but publishes every {} ms",
        "make the deadline longer than the period, with some margin",
    ),
    "lifespan_ms": (
        "messages of '{}' expire after {} ms, but are published every {} ms",
        "make the lifespan longer than the period",
    ),
}
_SENSOR_PACKAGE = "sensor_msgs/msg/"
#: Messages of that package that are small, and whose consumers usually request reliable QoS.
_STATES = frozenset({"sensor_msgs/msg/JointState", "sensor_msgs/msg/MultiDOFJointState"})
_COMMAND = re.compile(r"(^|[/_])(cmd|command|commands|order|orders)($|[/_])")


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
    known = known_profiles(context)
    for name in context.once(unknown_profiles):
        hint = (
            "omit 'qos' to use rclpy's defaults, or use 'command', which is the same"
            if name.value == "default"
            else suggestion(name.value, known)
        )
        yield Diagnostic(
            UNDECLARED_NAME,
            f"there is no QoS profile '{name}'",
            name.span,
            hint=hint,
            subjects=unknown_subjects("QoS profile", name.value, known),
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
    graph: dict[str, list[str]] = {name: [] for name in profiles}
    for name, profile in profiles.items():
        if profile.extends is not None and profile.extends.value in profiles:
            graph[name].append(profile.extends.value)
    hints = ("extend a preset", "extend a preset in one of them")
    for names in cycles(graph):
        links = [(name, profiles[name].extends or profiles[name].name) for name in names]
        yield cycle_of("QoS profile", ("extends", "extend"), links, hints)


@limited
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


def check_publishing_period(context: Context) -> Iterator[Diagnostic]:
    """Compare deadlines, lifespans and leases with the periods of the publishing timers."""
    for endpoint, period_s in context.once(timed_publishers):
        qos, period_ms = endpoint.port.qos, period_s * 1000.0
        is_renewed = qos.profile.liveliness is Liveliness.MANUAL_BY_TOPIC  # by its messages
        for policy, (problem, hint) in _TOO_SHORT.items():
            limit_ms = getattr(qos.profile, policy)
            if not qos.known or limit_ms is None or limit_ms >= period_ms:
                continue
            if policy != "liveliness_lease_duration_ms" or is_renewed:
                text = problem.format(endpoint.port.name, number(limit_ms), number(period_ms))
                span = qos.policy_span(policy)
                yield Diagnostic(QOS_DURATION_TOO_SHORT, text, span, hint=hint)


def check_shallow_queue(context: Context) -> Iterator[Diagnostic]:
    """Check the publishers and subscriptions of topics with a known rate."""
    for node in context.system.nodes:
        for port in node.ports:
            if port.kind.channel is not ChannelKind.TOPIC or not port.qos.known:
                continue
            if not _is_shallow(port.qos.profile):
                continue
            rate_hz = context.once(rates).topic_hz(port.full_name)
            if rate_hz is not None and rate_hz >= FAST_HZ:
                yield Diagnostic(
                    UNSUITED_QOS,
                    f"reliable topic '{port.full_name}' at {number(rate_hz)} Hz "
                    "has a queue depth of 1",
                    port.qos.policy_span("depth"),
                    hint="use a depth of 10, or best effort",
                )


def _is_shallow(profile: QosProfile) -> bool:
    return (
        profile.depth == 1
        and profile.history is History.KEEP_LAST
        and profile.reliability is Reliability.RELIABLE
        and profile.durability is Durability.VOLATILE
    )


def check_keep_all(context: Context) -> Iterator[Diagnostic]:
    """Check the history of every publisher and subscription; a shared profile is reported once."""
    for node in context.system.nodes:
        for port in node.ports:
            qos = port.qos
            if port.kind.channel is not ChannelKind.TOPIC or not qos.known:
                continue
            if qos.profile.history is History.KEEP_ALL:
                yield Diagnostic(
                    UNSUITED_QOS,
                    "'keep_all' lets queues grow without limit",
                    qos.policy_span("history"),
                    hint="use 'keep_last' with a depth",
                )


def check_reliable_sensor_stream(context: Context) -> Iterator[Diagnostic]:
    """Check publishers of sensor messages with a known rate."""
    for channel in context.channels:
        if channel.kind is not ChannelKind.TOPIC:
            continue
        for source in channel.sources:
            if not (_is_stream(source.port.interface.value) and _is_reliable(source.port)):
                continue
            rate_hz = context.once(rates).publisher_hz(source) or 0.0
            if rate_hz >= FAST_HZ:
                sinks = tuple(
                    islice((e for e in channel.sinks if _is_reliable(e.port)), _SHOWN_SINKS)
                )
                yield _reliable_stream(source.port, rate_hz, sinks)


def _is_stream(interface: str) -> bool:
    return interface.startswith(_SENSOR_PACKAGE) and interface not in _STATES


def _is_reliable(port: Port) -> bool:
    return port.qos.known and port.qos.profile.reliability is Reliability.RELIABLE


def _reliable_stream(port: Port, rate_hz: float, sinks: tuple[PortOfNode, ...]) -> Diagnostic:
    """Report a publisher; if it were best effort, it would not match the reliable ``sinks``."""
    if port.external:
        # Other consumers may request it reliably, and would no longer match.
        hint = "let subscriptions use 'qos: sensor_data'; a reliable publisher serves them too"
    elif sinks:
        hint = "use 'qos: sensor_data' for it and for the subscriptions that request reliable QoS"
    else:
        hint = "use 'qos: sensor_data'"
    return Diagnostic(
        UNSUITED_QOS,
        f"sensor data on '{port.full_name}' at {number(rate_hz)} Hz uses reliable QoS",
        port.qos.policy_span("reliability"),
        tuple(
            Label(sink.port.qos.policy_span("reliability"), f"'{port_name(sink)}' requests it")
            for sink in sinks
        ),
        hint,
        relies_on=(("topic qos", port.full_name),),
    )


def check_unreliable_command(context: Context) -> Iterator[Diagnostic]:
    """Check the reliability of publishers whose topic name suggests commands."""
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.PUBLISHER):
            if not port.qos.known or port.qos.profile.reliability is Reliability.RELIABLE:
                continue
            if _COMMAND.search(port.full_name):
                yield Diagnostic(
                    UNSUITED_QOS,
                    f"'{port.full_name}' carries commands, but is best effort and may lose them",
                    port.qos.policy_span("reliability"),
                    hint="use 'qos: command'",
                    relies_on=(("topic qos", port.full_name),),
                )


def check_unreliable_state(context: Context) -> Iterator[Diagnostic]:
    """Check the QoS that nodes set; a shared profile is reported once."""
    for node in context.system.nodes:
        if not node.implementation.declares_everything:
            continue  # its QoS is only described
        for port in node.ports:
            qos = port.qos
            if port.kind.channel is ChannelKind.TOPIC and qos.known and _is_lost(qos.profile):
                yield Diagnostic(
                    UNSUITED_QOS,
                    "with 'best_effort', late joiners get nothing in spite of 'transient_local'",
                    qos.policy_span("reliability"),
                    hint="use 'reliable' or 'volatile', "
                    "unless a node outside the system requires both",
                )


def _is_lost(profile: QosProfile) -> bool:
    return (profile.durability, profile.reliability) == (
        Durability.TRANSIENT_LOCAL,
        Reliability.BEST_EFFORT,
    )
