"""Decide how to handle failed nodes, and plan the transitions from observed to desired states.

The desired state of a failed node is unconfigured, that of the nodes that depend on it at most
inactive; all others keep theirs. The plan leads from the observed states to the desired ones
(:func:`composer.plan.plan_transitions`). A restart releases a failed node after a backoff.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from composer.model import OnFailure, PrimaryState, System
from composer.model.dependencies import DependencyEdge, dependency_edges, in_dependency_order
from composer.plan.steps import Plan, rank
from composer.plan.transitions import plan_transitions


class FaultKind(StrEnum):
    """How the failure of a node was detected."""

    TRANSITION = "transition"  # requested externally, ended in an error
    STEP = "step"  # a step of a plan failed
    SILENCE = "silence"
    CALLBACK = "callback"  # took too long and was interrupted
    ERRORS = "errors"  # too many of them
    LOST = "lost"  # a callback does not return and cannot be interrupted


@dataclass(frozen=True, slots=True)
class Fault:
    """A failure of a node. ``node`` is its key in the system."""

    node: str
    kind: FaultKind
    text: str


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


@dataclass(frozen=True, slots=True)
class Restart:
    """A scheduled restart of a failed node; see :class:`Decision` for ``attempt``."""

    node: str
    attempt: int
    due_s: float


@dataclass(frozen=True, slots=True)
class DesiredState:
    """The desired state of each node, by its key.

    ``goals`` are the states requested for the nodes, ``down`` the reasons why failed nodes are kept
    down anyway. ``scheduled`` are the restarts to come, ``restarts`` the times of earlier ones,
    oldest first, in seconds of the caller's clock.
    """

    goals: Mapping[str, PrimaryState]
    down: Mapping[str, str] = field(default_factory=dict)
    restarts: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    scheduled: Mapping[str, Restart] = field(default_factory=dict)

    @property
    def next_restart(self) -> Restart | None:
        """The scheduled restart that is due first."""
        return min(self.scheduled.values(), key=lambda restart: restart.due_s, default=None)

    def with_goals(self, goals: Mapping[str, PrimaryState]) -> DesiredState:
        """Return a copy with new goals for some of the nodes."""
        return replace(self, goals={**self.goals, **goals})

    def fail(self, fault: Fault) -> DesiredState:
        """Return a copy that keeps the node of ``fault`` down."""
        return replace(self, down={**self.down, fault.node: fault.text})

    def schedule(self, restart: Restart) -> DesiredState:
        """Return a copy with a restart of a node that is kept down."""
        return replace(self, scheduled={**self.scheduled, restart.node: restart})

    def restart(self, node: str, at_s: float) -> DesiredState:
        """Return a copy that releases the node and counts one more restart."""
        restarts = {**self.restarts, node: (*self.restarts.get(node, ()), at_s)}
        return replace(self.release(node), restarts=restarts)

    def release(self, node: str) -> DesiredState:
        """Return a copy that no longer keeps the node down, without a restart to come."""
        down = {name: reason for name, reason in self.down.items() if name != node}
        scheduled = {name: item for name, item in self.scheduled.items() if name != node}
        return replace(self, down=down, scheduled=scheduled)


def decide(system: System, desired: DesiredState, fault: Fault, now_s: float) -> Decision | None:
    """Return how to handle ``fault``; None if the node is unknown or already kept down."""
    node = system.node(fault.node)
    if node is None or fault.node in desired.down:
        return None
    policy = node.supervision.policy
    if policy is not OnFailure.RESTART:
        return Decision(policy, fault.text)
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
    blocked = blocked_nodes(system, desired)
    goals = dict(desired.goals)
    for name, goal in desired.goals.items():
        if name in desired.down:
            goals[name] = PrimaryState.UNCONFIGURED
        elif name in blocked:
            goals[name] = min(goal, PrimaryState.INACTIVE, key=rank)
    return goals


def blocked_nodes(system: System, desired: DesiredState) -> Mapping[str, str]:
    """Return the nodes that cannot be active, each with the failed node that it depends on."""
    blocked: dict[str, str] = {}
    for name, needs in _needs(system):
        for edge in needs:
            if name in desired.down or name in blocked:
                break
            if edge.on in desired.down:
                blocked[name] = edge.on
            elif edge.on in blocked and edge.state is PrimaryState.ACTIVE:
                blocked[name] = blocked[edge.on]  # blocked nodes stay inactive themselves
    return blocked


def reconcile(
    system: System, desired: DesiredState, states: Mapping[str, PrimaryState], why: str
) -> Plan:
    """Return the plan that leads from ``states`` to the desired states.

    ``why`` is the cause of each step that is not caused by a failed node.
    """
    blocked = blocked_nodes(system, desired)
    causes = {node.name.value: why for node in system.nodes}
    causes |= {name: f"it needs {failed}, which is down" for name, failed in blocked.items()}
    causes |= desired.down
    return plan_transitions(
        system, states, _reachable(system, states, desired_states(system, desired)), causes
    )


def _reachable(
    system: System, states: Mapping[str, PrimaryState], goals: Mapping[str, PrimaryState]
) -> Mapping[str, PrimaryState]:
    """Return the goals without those that would activate a node before what it depends on.

    A dependency that a user keeps down takes no node down, but no node is activated without it.
    """
    reachable = dict(goals)
    for name, needs in _needs(system):
        if name not in states or reachable.get(name) is not PrimaryState.ACTIVE:
            continue
        if any(rank(reachable.get(edge.on, edge.state)) < rank(edge.state) for edge in needs):
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
