"""Decide how to handle failed nodes, and plan the transitions from observed to desired states.

The desired state of a failed node is unconfigured, that of the nodes that depend on it at most
inactive unless they are moved externally after it; all others keep theirs. The plan leads from the
observed states to the desired ones (:func:`composer.plan.plan_transitions`). A restart releases a
failed node after a backoff.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from composer.fast_dataclass import dataclass
from composer.model import OnFailure, PrimaryState, System
from composer.model.dependencies import DependencyEdge, dependency_edges, in_dependency_order
from composer.plan.desired_state import DesiredState, Fault, FaultKind
from composer.plan.steps import Plan, rank
from composer.plan.transitions import plan_transitions


@dataclass(frozen=True, slots=True)
class Decision:
    """How to handle a fault.

    For ``restart``, the node is taken down now and brought up after ``wait_s``, as attempt number
    ``attempt`` within the window of its restart policy.
    """

    action: OnFailure
    reason: str
    wait_s: float = 0.0
    attempt: int = 0


def decide(system: System, desired: DesiredState, fault: Fault, now_s: float) -> Decision | None:
    """Return how to handle ``fault``; None if the node is unknown or already kept down.

    An absent node cannot be restarted, and is isolated until it returns.
    """
    node = system.node(fault.node)
    if node is None or fault.node in desired.down:
        return None
    policy = node.supervision.policy
    if policy is not OnFailure.RESTART:
        return Decision(policy, fault.text)
    if fault.kind is FaultKind.ABSENT:
        return Decision(OnFailure.ISOLATE, fault.text)
    if fault.kind is FaultKind.LOST:
        return Decision(OnFailure.SHUTDOWN, f"{fault.text}; it cannot be restarted")
    restart = node.supervision.restart
    since_s = now_s - restart.window_ms / 1000.0
    attempts = sum(at_s > since_s for at_s in desired.restarts.get(fault.node, ()))
    if attempts >= restart.max_attempts:
        times = "once" if attempts == 1 else f"{attempts} times"
        within = f"within {restart.window_ms / 1000.0:g} s"
        return Decision(OnFailure.SHUTDOWN, f"{fault.text}; restarted {times} {within} before")
    return Decision(OnFailure.RESTART, fault.text, restart.backoff_s(attempts), attempts + 1)


def desired_states(system: System, desired: DesiredState) -> Mapping[str, PrimaryState]:
    """Return the desired state of every node while the failed ones are kept down."""
    if not desired.down:
        return desired.goals
    blocked = blocked_nodes(system, desired)
    goals = dict(desired.goals)
    for name, goal in desired.goals.items():
        if name in desired.down:
            goals[name] = PrimaryState.UNCONFIGURED
        elif name in blocked:
            goals[name] = min(goal, PrimaryState.INACTIVE, key=rank)
    return goals


def blocked_nodes(system: System, desired: DesiredState) -> Mapping[str, str]:
    """Return the nodes that must not be active, each with the failed node that it depends on.

    A node that an external transition has moved since the failure is not among them.
    """
    blocked: dict[str, str] = {}
    if not desired.down:
        return blocked
    for name, needs in _needs(system):
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
    return plan_transitions(system, states, _reachable(system, states, goals), causes)


def _reachable(
    system: System, states: Mapping[str, PrimaryState], goals: Mapping[str, PrimaryState]
) -> Mapping[str, PrimaryState]:
    """Return the goals without those that would activate a node before what it depends on.

    A dependency that a user keeps down takes no node down, but no node is activated without it, nor
    before one without a state, which is in a transition or has failed.
    """
    reachable = dict(goals)
    for name, needs in _needs(system):
        if name not in states:
            reachable[name] = PrimaryState.UNCONFIGURED
        elif reachable.get(name) is PrimaryState.ACTIVE and any(
            rank(reachable.get(edge.on, edge.state)) < rank(edge.state) for edge in needs
        ):
            reachable[name] = max(states[name], PrimaryState.INACTIVE, key=rank)
    return reachable


def _needs(system: System) -> Iterator[tuple[str, tuple[DependencyEdge, ...]]]:
    """Yield every node in dependency order, with its dependencies."""
    edges = dependency_edges(system)
    needs: dict[str, list[DependencyEdge]] = {}
    for edge in edges:
        needs.setdefault(edge.node, []).append(edge)
    for name in in_dependency_order(system, edges):
        yield name, tuple(needs.get(name, ()))
