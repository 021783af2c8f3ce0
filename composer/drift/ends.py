"""Ports as declared and endpoints as seen."""

from __future__ import annotations

from collections.abc import Iterator

from composer.diagnostics import nearest, shown
from composer.drift.report import Drift, DriftKind
from composer.drift.snapshot import EndSeen, NodeSeen
from composer.model import ChannelKind, Node, Port, PortKind, System
from composer.qos import QosProfile

#: What a publisher or subscription tells every other process; history and depth are its own.
_TOLD = (
    "reliability",
    "durability",
    "deadline_ms",
    "lifespan_ms",
    "liveliness",
    "liveliness_lease_duration_ms",
)
#: Only what a publisher says about it counts.
_PUBLISHERS_ONLY = ("lifespan_ms",)

_Key = tuple[PortKind, str]


def compare_ends(node: Node, seen: NodeSeen) -> Iterator[Drift]:
    """Yield the differences between the ports of a node and its endpoints."""
    declared: dict[_Key, list[Port]] = {}
    for port in node.ports:
        declared.setdefault((port.kind, port.full_name), []).append(port)
    live: dict[_Key, list[EndSeen]] = {}
    for end in seen.ends:
        live.setdefault((end.kind, end.name), []).append(end)
    extra = {key: ends for key, ends in live.items() if key not in declared}
    for key, ports in declared.items():
        if key not in live:
            yield _missing(node, ports[0], seen, extra)
        else:
            yield from _of_same_name(node, ports, live[key])
    for kind, name in extra:
        yield Drift(DriftKind.EXTRA_ENDPOINT, node.full_name, f"{kind} {shown(name)}")


def conflicting_ends(system: System, other: NodeSeen) -> Iterator[Drift]:
    """Yield what a node that is not declared has of another type on a declared name."""
    types: dict[tuple[ChannelKind, str], Port] = {}
    for node in system.nodes:
        for port in node.ports:
            types.setdefault((port.kind.channel, port.full_name), port)
    for end in other.ends:
        known = types.get((end.kind.channel, end.name))
        if known is not None and end.type != known.interface.value:
            yield Drift(
                DriftKind.WRONG_TYPE,
                other.full_name,
                f"type of its {end.kind} {end.name}",
                known.interface.value,
                shown(end.type),
                span=known.interface.span,
            )


def _missing(node: Node, port: Port, seen: NodeSeen, extra: dict[_Key, list[EndSeen]]) -> Drift:
    close = nearest(port.full_name, [name for kind, name in extra if kind is port.kind])
    hint = f"it has '{shown(close)}': is that meant?" if close is not None else ""
    if seen.state in ("unconfigured", "finalized"):
        hint = f"the node is {seen.state}: it has no ports"
    return Drift(
        DriftKind.MISSING_ENDPOINT,
        node.full_name,
        f"{port.kind} {port.full_name}",
        port.interface.value,
        hint=hint,
        span=port.name.span,
    )


def _of_same_name(node: Node, ports: list[Port], ends: list[EndSeen]) -> Iterator[Drift]:
    port = ports[0]
    subject = f"{port.kind} {port.full_name}"
    others = [end for end in ends if end.type != port.interface.value]
    for end in others:
        yield Drift(
            DriftKind.WRONG_TYPE,
            node.full_name,
            f"type of {subject}",
            port.interface.value,
            shown(end.type),
            span=port.interface.span,
        )
    profiles = [each.qos.profile for each in ports]
    for end in ends:
        if end not in others and end.qos is not None and not _told(end.qos, profiles, port.kind):
            yield from _qos_differences(node, port, subject, end.qos)


def _told(live: QosProfile, declared: list[QosProfile], kind: PortKind) -> bool:
    """Say whether one of the declared profiles is what is told."""
    return any(not _differing(live, profile, kind) for profile in declared)


def _differing(live: QosProfile, declared: QosProfile, kind: PortKind) -> list[str]:
    return [
        policy
        for policy in _TOLD
        if getattr(live, policy) != getattr(declared, policy)
        and not (policy in _PUBLISHERS_ONLY and kind is not PortKind.PUBLISHER)
    ]


def _qos_differences(node: Node, port: Port, subject: str, live: QosProfile) -> Iterator[Drift]:
    for policy in _differing(live, port.qos.profile, port.kind):
        yield Drift(
            DriftKind.WRONG_QOS,
            node.full_name,
            f"{policy} of {subject}",
            _said(getattr(port.qos.profile, policy)),
            _said(getattr(live, policy)),
            span=port.qos.policy_span(policy),
        )


def _said(value: object) -> str:
    if value is None:
        return "no limit"
    return f"{value:g}" if isinstance(value, float) else str(value)
