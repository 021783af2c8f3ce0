"""What is done about a node that has failed: decided here, as data, and done by the runtime.

The whole of it is one idea: nodes that have failed are wanted down, nodes that need them are wanted
no further than inactive, all others where they were wanted before; and a plan leads from where the
nodes are to where they are wanted (:func:`composer.plan.reach`). A restart is a failed node that
after a while is wanted up again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from composer.model import OnFailure, PrimaryState, System
from composer.model.dependencies import Edge, dependency_edges, in_dependency_order
from composer.plan.reach import reach
from composer.plan.steps import Plan, rank


class FaultKind(StrEnum):
    """How it was found that a node has failed."""

    TRANSITION = "transition"  # one that was asked for from outside ended in an error
    STEP = "step"  # one of a plan did not lead where it should
    SILENCE = "silence"
    CALLBACK = "callback"  # one took too long, and was interrupted
    ERRORS = "errors"  # too many
    LOST = "lost"  # a callback does not return and cannot be interrupted


@dataclass(frozen=True, slots=True)
class Fault:
    """A node has failed. ``node`` is its key in the system, ``at_s`` a time of a steady clock."""

    node: str
    kind: FaultKind
    text: str
    at_s: float


@dataclass(frozen=True, slots=True)
class Decision:
    """What is to be done about a fault.

    With ``restart`` the node is taken down now and up again in ``wait_s``; that is attempt number
    ``attempt`` within the window of its budget.
    """

    action: OnFailure
    reason: str
    wait_s: float = 0.0
    attempt: int = 0


@dataclass(frozen=True, slots=True)
class DesiredState:
    """What has to be kept up, by the keys of nodes.

    ``goals`` is where each node is wanted, ``down`` why failed ones are held down nevertheless,
    ``restarts`` when each was restarted, oldest first.
    """

    goals: Mapping[str, PrimaryState]
    down: Mapping[str, str] = field(default_factory=dict)
    restarts: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    def want(self, goals: Mapping[str, PrimaryState]) -> DesiredState:
        """Return this with other goals for some of the nodes."""
        return replace(self, goals={**self.goals, **goals})

    def fail(self, fault: Fault) -> DesiredState:
        """Return this with the node of ``fault`` held down."""
        return replace(self, down={**self.down, fault.node: fault.text})

    def restart(self, node: str, at_s: float) -> DesiredState:
        """Return this with the node wanted up again, and one more restart to count."""
        restarts = {**self.restarts, node: (*self.restarts.get(node, ()), at_s)}
        return replace(self.release(node), restarts=restarts)

    def release(self, node: str) -> DesiredState:
        """Return this with the node held down no longer."""
        return replace(self, down={name: why for name, why in self.down.items() if name != node})


def judge(system: System, upkeep: DesiredState, fault: Fault) -> Decision | None:
    """Return what is to be done about ``fault``; None when the node is held down already."""
    node = system.node(fault.node)
    if node is None or fault.node in upkeep.down:
        return None
    policy = node.supervision.policy
    if policy is not OnFailure.RESTART:
        return Decision(policy, fault.text)
    if fault.kind is FaultKind.LOST:
        return Decision(OnFailure.SHUTDOWN, f"{fault.text}; it cannot be restarted")
    budget = node.supervision.restart
    since_s = fault.at_s - budget.window_ms / 1000.0
    attempts = sum(at_s > since_s for at_s in upkeep.restarts.get(fault.node, ()))
    if attempts >= budget.max_attempts:
        times = "once" if attempts == 1 else f"{attempts} times"
        within = f"within {budget.window_ms / 1000.0:g} s"
        return Decision(OnFailure.SHUTDOWN, f"{fault.text}; restarted {times} {within} before")
    return Decision(OnFailure.RESTART, fault.text, budget.backoff_s(attempts), attempts + 1)


def wanted(system: System, upkeep: DesiredState) -> Mapping[str, PrimaryState]:
    """Return where every node is to be, as long as the failed ones are held down."""
    held = held_back(system, upkeep)
    goals = dict(upkeep.goals)
    for name, goal in upkeep.goals.items():
        if name in upkeep.down:
            goals[name] = PrimaryState.UNCONFIGURED
        elif name in held:
            goals[name] = min(goal, PrimaryState.INACTIVE, key=rank)
    return goals


def held_back(system: System, upkeep: DesiredState) -> Mapping[str, str]:
    """Return the nodes that cannot be active, each with the failed one it needs in the end."""
    held: dict[str, str] = {}
    for name, needs in _needs(system):
        for edge in needs:
            if name in upkeep.down or name in held:
                break
            if edge.on in upkeep.down:
                held[name] = edge.on
            elif edge.on in held and edge.state is PrimaryState.ACTIVE:
                held[name] = held[edge.on]  # what is held back itself stays inactive
    return held


def mend(
    system: System, upkeep: DesiredState, states: Mapping[str, PrimaryState], why: str
) -> Plan:
    """Return the plan that leads from ``states`` to where the nodes are wanted now.

    ``why`` is the cause of every step that no failed node is the cause of.
    """
    held = held_back(system, upkeep)
    causes = {node.name.value: why for node in system.nodes}
    causes |= {name: f"it needs {failed}, which is down" for name, failed in held.items()}
    causes |= upkeep.down
    return reach(system, states, _reachable(system, states, wanted(system, upkeep)), causes)


def _reachable(
    system: System, states: Mapping[str, PrimaryState], goals: Mapping[str, PrimaryState]
) -> Mapping[str, PrimaryState]:
    """Return the goals, without those that would take a node up before what it needs.

    What somebody keeps low by hand takes nobody down, but nobody is sent after it either.
    """
    reachable = dict(goals)
    for name, needs in _needs(system):
        if name not in states or reachable.get(name) is not PrimaryState.ACTIVE:
            continue
        if any(rank(reachable.get(edge.on, edge.state)) < rank(edge.state) for edge in needs):
            reachable[name] = max(states[name], PrimaryState.INACTIVE, key=rank)
    return reachable


def _needs(system: System) -> Iterator[tuple[str, tuple[Edge, ...]]]:
    """Yield every node, behind those it depends on, with what it depends on."""
    edges = dependency_edges(system)
    needs: dict[str, list[Edge]] = {}
    for edge in edges:
        needs.setdefault(edge.node, []).append(edge)
    for name in in_dependency_order(system, edges):
        yield name, tuple(needs.get(name, ()))
