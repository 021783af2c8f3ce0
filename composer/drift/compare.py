"""The differences between a system as declared and a ROS graph as seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase

from composer.diagnostics import nearest, shown
from composer.drift.ends import compare_ends, conflicting_ends
from composer.drift.expected import states_after_bring_up
from composer.drift.parameters import compare_parameters
from composer.drift.report import Drift, DriftKind
from composer.drift.snapshot import NodeSeen, Snapshot
from composer.model import Node, PrimaryState, System

_MANAGER = "manager"
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
    """Return every difference, in the order of the system's nodes, then what is not declared.

    ``autostart`` is how far the system was brought up, if not as it says. ``ignored`` are patterns
    (as of a shell) of full names of nodes that may be there although nobody declared them.
    """
    return tuple(_differences(system, snapshot, autostart, ignored))


def _differences(
    system: System,
    snapshot: Snapshot,
    autostart: PrimaryState | None,
    ignored: Sequence[str],
) -> Iterator[Drift]:
    states = states_after_bring_up(system, autostart)
    declared = {node.full_name for node in system.nodes}
    others = [node for node in snapshot.nodes if node.full_name not in declared]
    for node in system.nodes:
        seen = snapshot.node(node.full_name)
        if seen is None:
            yield _missing(node, [other for other in others if not other.is_hidden])
        else:
            yield from _of_node(node, seen, states[node.name.value])
    for other in others:
        yield from conflicting_ends(system, other)
        may_be_there = other.is_hidden or _is_manager(system, other)
        if not may_be_there and not any(fnmatchcase(other.full_name, glob) for glob in ignored):
            yield Drift(DriftKind.EXTRA_NODE, other.full_name)


def _is_manager(system: System, other: NodeSeen) -> bool:
    """Say whether this is the node by which the composer lets the system itself be controlled."""
    return other.full_name.endswith(f"/{system.name.value}/{_MANAGER}") and any(
        end.name == f"{other.full_name}/{_MANAGER_SERVICE}" for end in other.ends
    )


def _missing(node: Node, others: Sequence[NodeSeen]) -> Drift:
    names = {other.full_name: other.full_name for other in others}
    by_last_part = {name.rpartition("/")[2]: name for name in names}
    close = nearest(node.full_name, names)
    if close is None:
        match = nearest(node.name.value, by_last_part)
        close = by_last_part[match] if match is not None else None
    hint = f"'{close}' is there: is it meant?" if close is not None else ""
    return Drift(DriftKind.MISSING_NODE, node.full_name, hint=hint, span=node.name.span)


def _of_node(node: Node, seen: NodeSeen, state: str) -> Iterator[Drift]:
    if seen.count > 1:
        yield Drift(
            DriftKind.DUPLICATE_NODE,
            node.full_name,
            declared="1",
            live=str(seen.count),
            span=node.name.span,
        )
    yield from _of_state(node, seen, state)
    if state in _WITH_PORTS or seen.state in _WITH_PORTS:
        yield from compare_ends(node, seen)
    yield from compare_parameters(node, seen)


def _of_state(node: Node, seen: NodeSeen, state: str) -> Iterator[Drift]:
    if seen.state is None:
        yield Drift(
            DriftKind.NO_ANSWER, node.full_name, "lifecycle state", state, span=node.name.span
        )
    elif seen.state != state:
        live = shown(seen.state) if seen.state else "none: it is no lifecycle node"
        yield Drift(
            DriftKind.WRONG_STATE,
            node.full_name,
            "lifecycle state",
            state,
            live,
            span=node.name.span,
        )
