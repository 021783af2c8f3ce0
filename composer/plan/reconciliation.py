"""Plan the transitions from observed to desired states, with failed nodes kept down.

The desired state of a failed node is unconfigured, that of the nodes that depend on it at most
inactive unless they are moved on request after it; all others keep theirs. The plan leads from the
observed states to the desired ones (:func:`composer.plan.plan_transitions`). A restart releases a
failed node after a backoff.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

from composer.model import PrimaryState, System
from composer.model.dependencies import DependencyEdge, dependency_edges, in_dependency_order
from composer.plan.desired_state import Condition, DesiredState
from composer.plan.transitions import Plan, nodes_of, plan_transitions, rank, start_goals

#: The condition of a node that takes its time.
STARTING = "starting"


def conditions(
    system: System,
    desired: DesiredState,
    states: Mapping[str, PrimaryState],
    moving: Collection[str],
) -> Mapping[str, str]:
    """Return what users need to know of nodes that are not where they should be, in words.

    ``moving`` are the nodes in a transition.
    """
    words: dict[str, str] = {}
    names = (node.name.value for node in system.nodes)
    is_at_goal = all(states.get(name) is desired.goals.get(name) for name in names)
    if is_at_goal and not (desired.down or desired.ignored or moving):
        return words  # the usual case, without looking at what the nodes depend on
    goals = desired_states(system, desired)
    for name, needs in _needs(system, desired):
        if name in desired.down:
            words[name] = desired.conditions.get(name, Condition.ISOLATED).value
        elif name in desired.ignored:
            words[name] = Condition.IGNORED.value
        elif name in moving:
            words[name] = STARTING
        elif states.get(name) is not desired.goals.get(name):
            missing = (edge.on for edge in needs if not _is_met(edge, states, goals))
            others = [node.full_name for node in nodes_of(system, missing)]
            if others:
                words[name] = f"waiting for {', '.join(others)}"
    return words


def is_settled(system: System, desired: DesiredState, moving: Collection[str]) -> bool:
    """Return whether a start is over: no required node is on its way up.

    ``moving`` are the nodes in a transition. A node that has had all of its restarts is not waited
    for, even if the window in which they count is over: it may fail forever.
    """
    for name in {*desired.scheduled, *desired.unhandled, *moving}:
        node = system.node(name)
        attempts = len(desired.restarts.get(name, ()))
        if node and node.required and attempts < node.supervision.restart.max_attempts:
            return False
    return True


def is_nothing_left(system: System, desired: DesiredState) -> bool:
    """Return whether every node is isolated or given up, or depends on such a node."""
    final = (Condition.ISOLATED, Condition.GIVEN_UP)
    lost = {name for name in desired.down if desired.conditions.get(name) in final}
    blocked = blocked_nodes(system, desired)
    names = (node.name.value for node in system.nodes)
    return bool(lost) and all(name in lost or blocked.get(name) in lost for name in names)


def optional_nodes(system: System) -> frozenset[str]:
    """Return the nodes that are not required, and those that depend on them."""
    optional: set[str] = set()
    for name, needs in _needs(system):
        node = system.node(name)
        if (node and not node.required) or any(edge.on in optional for edge in needs):
            optional.add(name)
    return frozenset(optional)


def desired_states(system: System, desired: DesiredState) -> Mapping[str, PrimaryState]:
    """Return the desired state of every node while the failed ones are kept down.

    A component is unloaded with its container, other nodes that depend on failed ones are inactive.
    """
    if not desired.down:
        return desired.goals
    blocked = blocked_nodes(system, desired)
    goals = dict(desired.goals)
    for name, goal in desired.goals.items():
        if name in desired.down:
            goals[name] = PrimaryState.UNCONFIGURED
        elif name in blocked:
            node = system.node(name)
            container = node.container.value if node and node.container else ""
            is_lost = container in desired.down or container in blocked
            limit = PrimaryState.UNCONFIGURED if is_lost else PrimaryState.INACTIVE
            goals[name] = min(goal, limit, key=rank)
    return goals


def blocked_nodes(system: System, desired: DesiredState) -> Mapping[str, str]:
    """Return the nodes that must not be active, each with the failed node that it depends on.

    A node that a requested transition has moved since the failure is not among them.
    """
    blocked: dict[str, str] = {}
    if not desired.down:
        return blocked
    for name, needs in _needs(system, desired):
        for edge in needs:
            if name in desired.down or name in blocked:
                break
            # Blocked nodes stay inactive themselves.
            is_blocked = edge.on in blocked and edge.state is PrimaryState.ACTIVE
            failed = blocked[edge.on] if is_blocked else edge.on
            if failed in desired.down and desired.failed_after_move_of(name, failed):
                blocked[name] = failed
    return blocked


def reconcile(
    system: System, desired: DesiredState, states: Mapping[str, PrimaryState], why: str
) -> Plan:
    """Return the plan that leads from ``states`` to the desired states.

    ``why`` is the cause of each step that is not caused by a failed node.
    """
    goals = desired_states(system, desired)
    if all(goals.get(name, at) is at for name, at in states.items()):
        return Plan(())
    blocked = blocked_nodes(system, desired)
    causes = {node.name.value: why for node in system.nodes}
    causes |= {name: f"it needs {failed}, which is down" for name, failed in blocked.items()}
    causes |= desired.down
    return plan_transitions(system, states, _reachable(system, desired, states), causes)


def _reachable(
    system: System, desired: DesiredState, states: Mapping[str, PrimaryState]
) -> Mapping[str, PrimaryState]:
    """Return the goals without those that would activate a node before what it depends on.

    A dependency that a user keeps down takes no node down, but no node is activated without it, nor
    before one without a state, which is in a transition or has failed. Nor is a class configured
    before, unless the system leaves both inactive: its constructor may wait for the dependency. Nor
    is a component loaded without its container. A node whose failure is ignored is not brought up
    again.
    """
    reachable = dict(desired_states(system, desired))
    for name, needs in _needs(system, desired):
        if name not in states:
            reachable[name] = PrimaryState.UNCONFIGURED
            continue
        if name in desired.ignored:
            reachable[name] = min(reachable.get(name, states[name]), states[name], key=rank)
        missing = [
            edge for edge in needs if rank(reachable.get(edge.on, edge.state)) < rank(edge.state)
        ]
        if missing and reachable.get(name) is PrimaryState.ACTIVE:
            reachable[name] = max(states[name], PrimaryState.INACTIVE, key=rank)
        is_awaited = desired.goals.get(name) is PrimaryState.ACTIVE or any(
            reachable.get(edge.on) != desired.goals.get(edge.on) for edge in missing
        )
        node = system.node(name)
        is_class = is_awaited and node is not None and node.hosted_class is not None
        if (missing and is_class) or any(edge.is_container for edge in missing):
            reachable[name] = min(reachable.get(name, states[name]), states[name], key=rank)
    return reachable


def _is_met(
    edge: DependencyEdge,
    states: Mapping[str, PrimaryState],
    goals: Mapping[str, PrimaryState],
) -> bool:
    at = states.get(edge.on)
    return at is not None and rank(min(at, goals.get(edge.on, at), key=rank)) >= rank(edge.state)


def _needs(
    system: System, desired: DesiredState | None = None
) -> Iterator[tuple[str, tuple[DependencyEdge, ...]]]:
    """Yield every node in dependency order, with its dependencies.

    Without those on nodes whose failure is ignored. A client that does not declare that it depends
    on its server needs it as far as the server starts.
    """
    ignored = {} if desired is None else desired.ignored
    edges = dependency_edges(system)
    starts = start_goals(system, PrimaryState.ACTIVE)
    needs: dict[str, list[DependencyEdge]] = {}
    for edge in edges:
        if edge.on not in ignored:
            needed = min(edge.state, starts[edge.on], key=rank) if edge.implied else edge.state
            needs.setdefault(edge.node, []).append(replace(edge, state=needed))
    for name in in_dependency_order(system):
        yield name, tuple(needs.get(name, ()))
