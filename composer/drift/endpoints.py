"""Compares declared ports with observed endpoints."""

from __future__ import annotations

from collections.abc import Iterator

from composer.diagnostics import nearest, shown
from composer.drift.drift import Drift, DriftKind
from composer.drift.snapshot import ObservedEndpoint, ObservedNode
from composer.model import ChannelKind, Node, Port, PortKind, System
from composer.qos import QosProfile

#: The policies that discovery reports for publishers and subscriptions; not history and depth.
_DISCOVERED_POLICIES = (
    "reliability",
    "durability",
    "deadline_ms",
    "lifespan_ms",
    "liveliness",
    "liveliness_lease_duration_ms",
)
#: Policies that apply to publishers only.
_PUBLISHERS_ONLY = ("lifespan_ms",)

_Key = tuple[PortKind, str]


def compare_endpoints(node: Node, observed: ObservedNode) -> Iterator[Drift]:
    """Yield the differences between the ports of a node and its endpoints."""
    declared: dict[_Key, list[Port]] = {}
    for port in node.visible_ports:
        declared.setdefault((port.kind, port.full_name), []).append(port)
    live: dict[_Key, list[ObservedEndpoint]] = {}
    for endpoint in observed.endpoints:
        live.setdefault((endpoint.kind, endpoint.name), []).append(endpoint)
    extra = {key: endpoints for key, endpoints in live.items() if key not in declared}
    for key, ports in declared.items():
        if key not in live:
            yield _missing(node, ports[0], observed, extra)
        else:
            yield from _of_same_name(node, ports, live[key])
    for kind, name in extra:
        yield Drift(DriftKind.EXTRA_ENDPOINT, node.full_name, f"{kind} {shown(name)}")


def conflicting_endpoints(system: System, other: ObservedNode) -> Iterator[Drift]:
    """Yield the endpoints of an undeclared node that use a declared name with another type."""
    types: dict[tuple[ChannelKind, str], Port] = {}
    for node in system.nodes:
        for port in node.ports:
            types.setdefault((port.kind.channel, port.full_name), port)
    for endpoint in other.endpoints:
        known = types.get((endpoint.kind.channel, endpoint.name))
        if known is not None and endpoint.type != known.interface.value:
            yield Drift(
                DriftKind.WRONG_TYPE,
                other.full_name,
                f"type of its {endpoint.kind} {endpoint.name}",
                known.interface.value,
                shown(endpoint.type),
                span=known.interface.span,
            )


def _missing(
    node: Node, port: Port, observed: ObservedNode, extra: dict[_Key, list[ObservedEndpoint]]
) -> Drift:
    close = nearest(port.full_name, [name for kind, name in extra if kind is port.kind])
    hint = f"it has '{shown(close)}': did you mean that?" if close is not None else ""
    if observed.state in ("unconfigured", "finalized"):
        hint = f"the node is {observed.state}: it has no ports"
    return Drift(
        DriftKind.MISSING_ENDPOINT,
        node.full_name,
        f"{port.kind} {port.full_name}",
        port.interface.value,
        hint=hint,
        span=port.name.span,
    )


def _of_same_name(
    node: Node, ports: list[Port], endpoints: list[ObservedEndpoint]
) -> Iterator[Drift]:
    port = ports[0]
    subject = f"{port.kind} {port.full_name}"
    others = [endpoint for endpoint in endpoints if endpoint.type != port.interface.value]
    for endpoint in others:
        yield Drift(
            DriftKind.WRONG_TYPE,
            node.full_name,
            f"type of {subject}",
            port.interface.value,
            shown(endpoint.type),
            span=port.interface.span,
        )
    profiles = [each.qos.profile for each in ports]
    for endpoint in endpoints:
        if (
            endpoint not in others
            and endpoint.qos is not None
            and not _matches_any(endpoint.qos, profiles, port.kind)
        ):
            yield from _qos_differences(node, port, subject, endpoint.qos)


def _matches_any(live: QosProfile, declared: list[QosProfile], kind: PortKind) -> bool:
    """Return whether the live profile matches one of the declared profiles."""
    return any(not _differing(live, profile, kind) for profile in declared)


def _differing(live: QosProfile, declared: QosProfile, kind: PortKind) -> list[str]:
    return [
        policy
        for policy in _DISCOVERED_POLICIES
        if getattr(live, policy) != getattr(declared, policy)
        and not (policy in _PUBLISHERS_ONLY and kind is not PortKind.PUBLISHER)
    ]


def _qos_differences(node: Node, port: Port, subject: str, live: QosProfile) -> Iterator[Drift]:
    for policy in _differing(live, port.qos.profile, port.kind):
        yield Drift(
            DriftKind.WRONG_QOS,
            node.full_name,
            f"{policy} of {subject}",
            _format(getattr(port.qos.profile, policy)),
            _format(getattr(live, policy)),
            span=port.qos.policy_span(policy),
        )


def _format(value: object) -> str:
    if value is None:
        return "no limit"
    return f"{value:g}" if isinstance(value, float) else str(value)
