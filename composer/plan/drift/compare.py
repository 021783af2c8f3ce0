"""The differences between a system as declared and a ROS graph as observed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatchcase

from composer.base.diagnostics import nearest, nearest_full_name, shown
from composer.base.source import Located
from composer.language.tree import Plain
from composer.model import (
    ChannelKind,
    ExecutableKind,
    Node,
    Outside,
    Parameter,
    Port,
    PortKind,
    PrimaryState,
    System,
)
from composer.model.qos import DISCOVERED_POLICIES, QosProfile
from composer.plan import bring_up
from composer.plan.drift.drift import (
    MANAGER,
    Drift,
    DriftKind,
    ObservedEndpoint,
    ObservedNode,
    Snapshot,
    is_manager,
)

_NODES_HINT = "if its program creates them all, list their names under 'nodes' of the executable"
#: States in which a node has its ports.
_WITH_PORTS = ("inactive", "active")
#: Policies that apply to publishers only.
_PUBLISHERS_ONLY = ("lifespan_ms",)


def compare(
    system: System,
    snapshot: Snapshot,
    *,
    autostart: PrimaryState | None = None,
    ignored: Sequence[str] = (),
) -> tuple[Drift, ...]:
    """Return all differences: first of the declared nodes, in order, then undeclared nodes.

    ``autostart`` is the state the system was brought up to, if it differs from the declared one.
    ``ignored`` are shell patterns of full names of undeclared nodes to ignore.
    """
    return tuple(_differences(system, snapshot, autostart, ignored))


def _differences(
    system: System,
    snapshot: Snapshot,
    autostart: PrimaryState | None,
    ignored: Sequence[str],
) -> Iterator[Drift]:
    states = states_after_bring_up(system, autostart)
    declared = {name for node in system.nodes for name in (node.full_name, *node.inner_nodes)}
    others = [node for node in snapshot.nodes if node.full_name not in declared]
    for node in system.nodes:
        observed = snapshot.node(node.full_name)
        state = states[node.name.value]
        if not _may_be_absent(node, state):
            absent = (name for name in node.inner_nodes if snapshot.node(name) is None)
            yield from (Drift(DriftKind.MISSING_NODE, name, span=node.name.span) for name in absent)
        if observed is None:
            if _may_be_absent(node, state):
                continue
            yield _missing_node(node, [other for other in others if not other.is_hidden])
        else:
            yield from _of_node(node, observed, state)
    for other in others:
        yield from _conflicting_endpoints(system, other)
        is_expected = other.is_hidden or _is_manager(system, other)
        if not is_expected and not any(fnmatchcase(other.full_name, glob) for glob in ignored):
            yield Drift(DriftKind.EXTRA_NODE, other.full_name)


def _may_be_absent(node: Node, state: str) -> bool:
    """Return whether a node is not started in ``state``, or has had a process that is done."""
    if node.outside is None or node.external is not None:
        return False
    executable = node.executable
    if executable is None:
        return _is_not_started(node.outside, state)
    are_unknown = node.keeps_names and not executable.nodes
    if are_unknown or executable.kind is ExecutableKind.TASK:
        return True
    return _is_not_started(executable, state)


def _is_not_started(outside: Outside, state: str) -> bool:
    return state == "unconfigured" or (state == "inactive" and not outside.is_managed)


def _has_lifecycle(node: Node) -> bool:
    """Return whether the node itself is a lifecycle node, as far as it is declared."""
    return node.outside is None or node.outside.is_managed


def _is_manager(system: System, other: ObservedNode) -> bool:
    """Return whether this is the manager node of the system, or of one of its processes."""
    name = system.name.value
    names = (name, *(f"{name}/{process.name}" for process in system.processes))
    return is_manager(other.full_name, other.endpoints) and any(
        other.full_name.endswith(f"/{part}/{MANAGER}") for part in names
    )


def _missing_node(node: Node, others: Sequence[ObservedNode]) -> Drift:
    close = nearest_full_name(node.full_name, [other.full_name for other in others])
    hint = f"'{close}' exists: did you mean that?" if close is not None else ""
    return Drift(DriftKind.MISSING_NODE, node.full_name, hint=hint, span=node.name.span)


def _of_node(node: Node, observed: ObservedNode, state: str) -> Iterator[Drift]:
    if observed.count > 1:
        yield Drift(
            DriftKind.DUPLICATE_NODE,
            node.full_name,
            declared="1",
            live=str(observed.count),
            hint=_NODES_HINT if node.executable is not None and not node.keeps_names else "",
            span=node.name.span,
        )
    yield from _of_state(node, observed, state)
    is_described = node.ports or node.implementation.in_process
    if is_described and (state in _WITH_PORTS or observed.state in _WITH_PORTS):
        yield from _of_endpoints(node, observed)
    yield from _of_parameters(node, observed)


def _of_state(node: Node, observed: ObservedNode, state: str) -> Iterator[Drift]:
    if observed.state is None:
        yield Drift(
            DriftKind.NO_ANSWER, node.full_name, "lifecycle state", state, span=node.name.span
        )
    elif observed.state != state and (observed.state or _has_lifecycle(node)):
        live = shown(observed.state) if observed.state else "none: it is not a lifecycle node"
        yield Drift(
            DriftKind.WRONG_STATE,
            node.full_name,
            "lifecycle state",
            state,
            live,
            span=node.name.span,
        )


def states_after_bring_up(system: System, autostart: PrimaryState | None = None) -> dict[str, str]:
    """Return the lifecycle state that the bring-up moves each node to, by its key in the system."""
    states = {node.name.value: PrimaryState.UNCONFIGURED for node in system.nodes}
    reached = bring_up(system, autostart).states_after(states)
    return {name: state.value for name, state in reached.items()}


def _of_endpoints(node: Node, observed: ObservedNode) -> Iterator[Drift]:
    """Yield the differences between the ports of a node and its endpoints."""
    declared: dict[tuple[PortKind, str], list[Port]] = {}
    for port in node.visible_ports:
        declared.setdefault((port.kind, port.full_name), []).append(port)
    live: dict[tuple[PortKind, str], list[ObservedEndpoint]] = {}
    for endpoint in observed.endpoints:
        live.setdefault((endpoint.kind, endpoint.name), []).append(endpoint)
    extra = {key: endpoints for key, endpoints in live.items() if key not in declared}
    for key, ports in declared.items():
        if key not in live:
            yield _missing_endpoint(node, ports[0], observed, extra)
        else:
            yield from _of_same_endpoint(node, ports, live[key])
    for kind, name in extra:
        yield Drift(DriftKind.EXTRA_ENDPOINT, node.full_name, f"{kind} {shown(name)}")


def _conflicting_endpoints(system: System, other: ObservedNode) -> Iterator[Drift]:
    """Yield the endpoints of an undeclared node that use a declared name with another type."""
    types: dict[tuple[ChannelKind, str], Port] = {}
    for node in system.nodes:
        for port in node.ports:
            types.setdefault((port.kind.channel, port.full_name), port)
    for endpoint in other.endpoints:
        declared = types.get((endpoint.kind.channel, endpoint.name))
        if declared is not None and endpoint.type != declared.interface.value:
            yield Drift(
                DriftKind.WRONG_TYPE,
                other.full_name,
                f"type of its {endpoint.kind} {endpoint.name}",
                declared.interface.value,
                shown(endpoint.type),
                span=declared.interface.span,
            )


def _missing_endpoint(
    node: Node,
    port: Port,
    observed: ObservedNode,
    extra: dict[tuple[PortKind, str], list[ObservedEndpoint]],
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


def _of_same_endpoint(
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
        if endpoint in others or endpoint.qos is None:
            continue
        if all(_differing(endpoint.qos, profile, port.kind) for profile in profiles):
            yield from _qos_differences(node, port, subject, endpoint.qos)


def _differing(live: QosProfile, declared: QosProfile, kind: PortKind) -> list[str]:
    return [
        policy
        for policy in DISCOVERED_POLICIES
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


def _of_parameters(node: Node, observed: ObservedNode) -> Iterator[Drift]:
    """Yield the declared parameters that the node does not have, and those with another value.

    Further parameters of the node, such as ``use_sim_time``, are ignored.
    """
    declared = _with_values(node.parameters)
    if observed.parameters is None:
        if declared:
            yield Drift(DriftKind.NO_ANSWER, node.full_name, "parameters", span=node.name.span)
        return
    names = {parameter.name.value for parameter, _ in declared}
    for parameter, value in declared + _with_values(node.undeclared_parameters):
        name = parameter.name.value
        subject = f"parameter {name}"
        if name in observed.parameters:
            live = observed.parameters[name]
            if not _same(value.value, live):
                yield Drift(
                    DriftKind.WRONG_PARAMETER,
                    node.full_name,
                    subject,
                    shown(value.value),
                    shown(live),
                    span=value.span,
                )
        elif name in names:
            yield Drift(
                DriftKind.MISSING_PARAMETER,
                node.full_name,
                subject,
                shown(value.value),
                span=parameter.name.span,
            )


def _with_values(parameters: Iterable[Parameter]) -> list[tuple[Parameter, Located[Plain]]]:
    return [(item, item.value) for item in parameters if item.value is not None]


def _same(declared: object, live: object) -> bool:
    """Return whether two values are equal in ROS: true is not 1, but 1 is 1.0."""
    if isinstance(declared, list) and isinstance(live, list):
        return len(declared) == len(live) and all(map(_same, declared, live))
    if isinstance(declared, bool) or isinstance(live, bool):
        return declared is live
    return declared == live
