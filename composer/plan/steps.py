"""Plans: steps in phases, each with its cause and the steps that it waits for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Literal, TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.model import Node, PrimaryState, System
from composer.model.dependencies import DependencyEdge
from composer.model.lifecycle import FINALIZED, TRANSITIONS

TransitionName: TypeAlias = Literal["configure", "activate", "deactivate", "cleanup", "shutdown"]


_UPWARD = ("configure", "activate")


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


#: The state in which each transition ends; shutdown leaves the primary states of a plan.
REACHED = {
    name: PrimaryState.UNCONFIGURED if item.goal == FINALIZED else PrimaryState(item.goal)
    for name, item in TRANSITIONS.items()
}


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


_RANK = {PrimaryState.UNCONFIGURED: 0, PrimaryState.INACTIVE: 1, PrimaryState.ACTIVE: 2}
