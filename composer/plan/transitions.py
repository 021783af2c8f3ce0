"""Plans and how they are made: bring-up, tear-down, and from any states of nodes to others.

A plan has steps in phases, each with its cause and the steps that it waits for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby
from typing import Literal, TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.model import Dependency, Node, PrimaryState, System
from composer.model.dependencies import DependencyEdge, dependency_edges, in_dependency_order
from composer.model.lifecycle import FINALIZED, TRANSITIONS

TransitionName: TypeAlias = Literal["configure", "activate", "deactivate", "cleanup", "shutdown"]

_UPWARD = ("configure", "activate")
_ACTIVE, _INACTIVE = PrimaryState.ACTIVE, PrimaryState.INACTIVE
_RANK = {PrimaryState.UNCONFIGURED: 0, PrimaryState.INACTIVE: 1, PrimaryState.ACTIVE: 2}
#: The state in which each transition ends; shutdown leaves the primary states of a plan.
REACHED = {
    name: PrimaryState.UNCONFIGURED if item.goal == FINALIZED else PrimaryState(item.goal)
    for name, item in TRANSITIONS.items()
}


@dataclass(frozen=True, slots=True)
class Step:
    """One transition of one node. ``number`` counts from 1; ``node`` is its key in the system.

    ``after`` are the numbers of the steps that have to finish first: of the same phase, or of
    earlier ones if its node is a class. Without ``is_awaited``, only these nodes wait for the step:
    its node is not required, or something outside the system has to happen for it.
    """

    number: int
    transition: TransitionName
    node: str
    full_name: str
    cause: str
    after: tuple[int, ...] = ()
    is_awaited: bool = True

    @property
    def is_upward(self) -> bool:
        """Whether it needs what the node depends on."""
        return self.transition in _UPWARD

    def __str__(self) -> str:
        after = f" after {' '.join(f'#{number}' for number in self.after)}" if self.after else ""
        return f"#{self.number} {self.transition} {self.full_name}{after}: {self.cause}"


@dataclass(frozen=True, slots=True)
class Plan:
    """Steps in an order in which they can be carried out."""

    steps: tuple[Step, ...]

    @property
    def phases(self) -> tuple[tuple[Step, ...], ...]:
        """The steps by phase: consecutive steps with the same transition.

        A phase starts when the one before it has finished. Within a phase, steps that do not wait
        for each other may run at the same time.
        """
        grouped = groupby(self.steps, key=lambda step: step.transition)
        return tuple(tuple(steps) for _, steps in grouped)

    def states_after(self, states: Mapping[str, PrimaryState]) -> Mapping[str, PrimaryState]:
        """Return the states to which the plan leads from ``states``, by the keys of nodes."""
        reached = {step.node: REACHED[step.transition] for step in self.steps}
        return {**states, **reached}

    def __str__(self) -> str:
        return "\n".join(str(step) for step in self.steps)


@dataclass(frozen=True, slots=True)
class Phase:
    """Nodes that make the same transition, in order.

    ``waits`` are pairs of a node and the node that it waits for.
    """

    transition: TransitionName
    nodes: Sequence[Node]
    waits: Iterable[tuple[str, str]]


def build_plan(phases: Iterable[Phase], causes: Mapping[str, str]) -> Plan:
    """Return the numbered steps of the phases, without waits for nodes that come later.

    Nodes that are configured after others are active wait for these.
    """
    steps: list[Step] = []
    latest: dict[str, int] = {}
    activated: dict[str, int] = {}
    for phase in phases:
        earlier = {"configure": latest, "activate": activated}.get(phase.transition, {})
        numbers: dict[str, int] = {}
        needed: dict[str, list[str]] = {}
        for waiting, other in phase.waits:
            needed.setdefault(waiting, []).append(other)
        for node in phase.nodes:
            name = node.name.value
            numbered = (numbers.get(other, earlier.get(other)) for other in needed.get(name, ()))
            after = {number for number in numbered if number is not None}
            numbers[name] = len(steps) + 1
            steps.append(
                Step(
                    numbers[name],
                    phase.transition,
                    name,
                    node.full_name,
                    causes[name],
                    tuple(sorted(after)),
                    _is_awaited(phase.transition, node),
                )
            )
        latest |= numbers
        activated |= numbers if phase.transition == "activate" else {}
    return Plan(tuple(steps))


def _is_awaited(transition: TransitionName, node: Node) -> bool:
    """Return whether a plan waits for a transition.

    External nodes have to appear, executables of this process have to start, components to load.
    """
    if transition not in _UPWARD:
        return True
    is_started_here = node.outside is not None and node.process is None
    return node.required and node.external is None and not is_started_here


def upward(edges: Iterable[DependencyEdge], state: PrimaryState) -> Iterable[tuple[str, str]]:
    """Yield (node, dependency) for each dependency needed in ``state`` or above."""
    for edge in edges:
        if rank(edge.state) >= rank(state):
            yield edge.node, edge.on


def downward(edges: Iterable[DependencyEdge], state: PrimaryState) -> Iterable[tuple[str, str]]:
    """Yield (dependency, node): on the way down, a dependency waits for its dependents."""
    for node, other in upward(edges, state):
        yield other, node


def rank(state: PrimaryState) -> int:
    """Return the rank of a state: unconfigured 0, inactive 1, active 2."""
    return _RANK[state]


def nodes_of(system: System, names: Iterable[str]) -> tuple[Node, ...]:
    """Return the nodes with the given names, in the order of the names."""
    found = (system.node(name) for name in names)
    return tuple(node for node in found if node is not None)


def plan_transitions(
    system: System,
    states: Mapping[str, PrimaryState],
    goals: Mapping[str, PrimaryState],
    causes: Mapping[str, str],
) -> Plan:
    """Return the plan that takes the nodes from ``states`` to ``goals``, in dependency order.

    First every transition down, in reverse order, then every transition up. A class or a component
    is configured once the nodes that it depends on are active, and a component is unloaded before
    its container is deactivated. ``causes`` gives the reason for each node. Nodes
    without a state or a goal are left alone.
    """
    edges = dependency_edges(system)
    order = nodes_of(system, in_dependency_order(system))
    movable = [node for node in order if node.name.value in states and node.name.value in goals]
    starts = {node.name.value: rank(states[node.name.value]) for node in movable}
    ends = {node.name.value: rank(goals[node.name.value]) for node in movable}

    def passing(nodes: Iterable[Node], state: PrimaryState, *, up: bool) -> list[Node]:
        low, high = (starts, ends) if up else (ends, starts)
        return [
            node for node in nodes if low[node.name.value] < rank(state) <= high[node.name.value]
        ]

    phases: list[Phase] = []
    for wave in _downward_waves(movable, edges):
        phases += (
            Phase("deactivate", passing(wave, _ACTIVE, up=False), downward(edges, _ACTIVE)),
            Phase("cleanup", passing(wave, _INACTIVE, up=False), downward(edges, _INACTIVE)),
        )
    for wave in _waves(movable, edges, _is_configured_later):
        phases += (
            Phase("configure", passing(wave, _INACTIVE, up=True), upward(edges, _INACTIVE)),
            Phase("activate", passing(wave, _ACTIVE, up=True), upward(edges, _ACTIVE)),
        )
    return build_plan(phases, causes)


def _is_configured_later(node: Node, edge: DependencyEdge) -> bool:
    """Return whether a node is configured after the other one is active.

    A class does its work in its constructor, which may wait for messages and responses of the nodes
    that it depends on. An inactive container may have no process.
    """
    return edge.is_container or (node.hosted_class is not None and edge.state is _ACTIVE)


def _downward_waves(
    movable: Sequence[Node], edges: Iterable[DependencyEdge]
) -> Iterable[Sequence[Node]]:
    """Return the nodes that are deactivated, then cleaned up together, in reverse order.

    A component is unloaded before its container is deactivated, which may end the container.
    """
    waves = _waves(movable, edges, lambda _, edge: edge.is_container)
    return (wave[::-1] for wave in reversed(waves))


def _waves(
    movable: Sequence[Node],
    edges: Iterable[DependencyEdge],
    is_later: Callable[[Node, DependencyEdge], bool],
) -> list[list[Node]]:
    """Return the nodes in waves: a node is at least in the wave of the nodes that it depends on.

    It is in a later one where ``is_later`` says so.
    """
    needs: dict[str, list[DependencyEdge]] = {}
    for edge in edges:
        needs.setdefault(edge.node, []).append(edge)
    waves: list[list[Node]] = [[]]
    number: dict[str, int] = {}
    for node in movable:
        own = 0
        for edge in needs.get(node.name.value, ()):
            if edge.on in number:
                own = max(own, number[edge.on] + is_later(node, edge))
        number[node.name.value] = own
        waves += [[] for _ in range(own + 1 - len(waves))]
        waves[own].append(node)
    return waves


def bring_up(system: System, autostart: PrimaryState | None = None) -> Plan:
    """Return the plan that brings the system up from unconfigured.

    Every node goes as far as ``autostart`` (the system's own by default), but not beyond its own
    ``autostart``, nor beyond a dependency that stays below the state in which it is needed.
    """
    goal = system.autostart if autostart is None else autostart
    states = {node.name.value: PrimaryState.UNCONFIGURED for node in system.nodes}
    return plan_transitions(system, states, start_goals(system, goal), start_causes(system, goal))


def tear_down(system: System, process: str | None = None) -> Plan:
    """Return the plan that deactivates, cleans up and shuts down every node.

    With ``process``, those that this process of the system runs, in the order of the whole system.

    Each phase runs in reverse bring-up order. The plan assumes a system that is fully up; skip the
    steps that a node's current state does not allow.
    """
    edges = dependency_edges(system)
    order = nodes_of(system, in_dependency_order(system))
    if process is not None:
        order = tuple(node for node in order if node.process and node.process.value == process)
    phases: list[Phase] = []
    for wave in _downward_waves(order, edges):
        phases += (
            Phase("deactivate", wave, downward(edges, _ACTIVE)),
            Phase("cleanup", wave, downward(edges, _INACTIVE)),
        )
    phases.append(Phase("shutdown", order[::-1], downward(edges, _INACTIVE)))
    return build_plan(
        phases,
        {node.name.value: "system is shutting down" for node in system.nodes},
    )


def start_goals(system: System, goal: PrimaryState) -> Mapping[str, PrimaryState]:
    """Return the state in which each node starts when the system as a whole goes to ``goal``."""
    goals: dict[str, PrimaryState] = {}
    for node in nodes_of(system, in_dependency_order(system)):
        limits = [_limit(dependency, goals) for dependency in node.depends_on]
        own = [] if node.autostart is None else [node.autostart.value]
        goals[node.name.value] = min([goal, *own, *limits], key=rank)
    return goals


def start_causes(system: System, goal: PrimaryState) -> Mapping[str, str]:
    """Return the reason for each node's place in the bring-up order."""
    edges = dependency_edges(system)
    declared = _dependents(edge for edge in edges if not edge.implied)
    implied = _dependents(edge for edge in edges if edge.implied)
    return {node.name.value: _cause(node, goal, declared, implied) for node in system.nodes}


def _cause(
    node: Node,
    goal: PrimaryState,
    declared: Mapping[str, tuple[str, ...]],
    implied: Mapping[str, tuple[str, ...]],
) -> str:
    name = node.name.value
    if name in declared:
        users = declared[name]
        return f"{_listing(users)} {'depends' if len(users) == 1 else 'depend'} on it"
    if name in implied:
        users = implied[name]
        verb = "calls" if len(users) == 1 else "call"
        return f"{_listing(users)} {verb} it, and servers start before their clients"
    if node.autostart is not None and rank(node.autostart.value) < rank(goal):
        return f"its own autostart is {node.autostart.value}"
    return f"system autostart is {goal}"


def _limit(dependency: Dependency, goals: Mapping[str, PrimaryState]) -> PrimaryState:
    """Return the highest state that a dependency allows its node."""
    reached = goals.get(dependency.node.value, dependency.state)
    if rank(reached) >= rank(dependency.state):
        return PrimaryState.ACTIVE
    return PrimaryState.UNCONFIGURED if dependency.is_container else reached


def _dependents(edges: Iterable[DependencyEdge]) -> dict[str, tuple[str, ...]]:
    """Return the names of the nodes that wait for each node."""
    users: dict[str, dict[str, None]] = {}
    for edge in edges:
        users.setdefault(edge.on, {})[edge.node] = None
    return {name: tuple(waiting) for name, waiting in users.items()}


def _listing(names: tuple[str, ...]) -> str:
    """Return one or two names, or the first name and the number of others."""
    if len(names) <= 2:
        return " and ".join(names)
    return f"{names[0]} and {len(names) - 1} others"
