"""The differences between a system as declared and a ROS graph as observed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase

from composer.diagnostics import nearest, shown
from composer.drift.drift import Drift, DriftKind
from composer.drift.endpoints import compare_endpoints, conflicting_endpoints
from composer.drift.parameters import compare_parameters
from composer.drift.snapshot import ObservedNode, Snapshot
from composer.model import ExecutableKind, LifecycleKind, Node, PrimaryState, System
from composer.plan import bring_up

_MANAGER = "manager"
_NODES_HINT = "if its program creates them all, list their names under 'nodes' of the executable"
_MANAGER_SERVICE = "is_active"
#: States in which a node has its ports.
_WITH_PORTS = ("inactive", "active")


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
            yield _missing(node, [other for other in others if not other.is_hidden])
        else:
            yield from _of_node(node, observed, state)
    for other in others:
        yield from conflicting_endpoints(system, other)
        is_expected = other.is_hidden or _is_manager(system, other)
        if not is_expected and not any(fnmatchcase(other.full_name, glob) for glob in ignored):
            yield Drift(DriftKind.EXTRA_NODE, other.full_name)


def _may_be_absent(node: Node, state: str) -> bool:
    """Return whether a node has no process in ``state``, or has had one that is done."""
    executable = node.executable
    if executable is None or node.external is not None:
        return False
    are_unknown = node.keeps_names and not executable.nodes
    if are_unknown or executable.kind is ExecutableKind.TASK:
        return True
    is_managed = executable.lifecycle is LifecycleKind.MANAGED
    return state == "unconfigured" or (state == "inactive" and not is_managed)


def _has_lifecycle(node: Node) -> bool:
    """Return whether the node itself is a lifecycle node, as far as it is declared."""
    outside = node.external or node.executable
    return outside is None or outside.lifecycle is LifecycleKind.MANAGED


def _is_manager(system: System, other: ObservedNode) -> bool:
    """Return whether this is the manager node of the system, or of one of its processes."""
    name = system.name.value
    processes = (f"{name}/{process.name.value}" for process in system.processes)
    return any(
        other.full_name.endswith(f"/{part}/{_MANAGER}") for part in (name, *processes)
    ) and any(
        endpoint.name == f"{other.full_name}/{_MANAGER_SERVICE}" for endpoint in other.endpoints
    )


def _missing(node: Node, others: Sequence[ObservedNode]) -> Drift:
    names = {other.full_name: other.full_name for other in others}
    by_last_part = {name.rpartition("/")[2]: name for name in names}
    close = nearest(node.full_name, names)
    if close is None:
        match = nearest(node.ros_name.value, by_last_part)
        close = by_last_part[match] if match is not None else None
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
        yield from compare_endpoints(node, observed)
    yield from compare_parameters(node, observed)


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
