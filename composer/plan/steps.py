"""What a plan is: steps in phases, each with its cause and with what it waits for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal, TypeAlias

from composer.model import Node, PrimaryState, System
from composer.model.dependencies import Edge

TransitionName: TypeAlias = Literal["configure", "activate", "deactivate", "cleanup", "shutdown"]


@dataclass(frozen=True, slots=True)
class Step:
    """One transition of one node. ``number`` counts from 1; ``node`` is its key in the system.

    ``after`` are the numbers of the steps of the same phase that have to be done first.
    """

    number: int
    transition: TransitionName
    node: str
    full_name: str
    cause: str
    after: tuple[int, ...] = ()

    def __str__(self) -> str:
        after = f" after {' '.join(f'#{number}' for number in self.after)}" if self.after else ""
        return f"#{self.number} {self.transition} {self.full_name}{after}: {self.cause}"


@dataclass(frozen=True, slots=True)
class Plan:
    """Steps in an order that they can be made in."""

    steps: tuple[Step, ...]

    @property
    def phases(self) -> tuple[tuple[Step, ...], ...]:
        """The steps by phase: neighbours with the same transition.

        A phase begins when the one before is over. Within a phase, steps that do not wait for each
        other may be made at the same time.
        """
        grouped = groupby(self.steps, key=lambda step: step.transition)
        return tuple(tuple(steps) for _, steps in grouped)

    def __str__(self) -> str:
        return "\n".join(str(step) for step in self.steps)


@dataclass(frozen=True, slots=True)
class Phase:
    """Nodes that all make one transition, in order, and who waits for whom among them.

    ``waits`` has (node, the one it waits for).
    """

    transition: TransitionName
    nodes: Sequence[Node]
    waits: Iterable[tuple[str, str]]


def plan_of(phases: Iterable[Phase], causes: Mapping[str, str]) -> Plan:
    """Return the steps of the phases, numbered. A wait for a node that comes later is left out."""
    steps: list[Step] = []
    for phase in phases:
        numbers: dict[str, int] = {}
        needed: dict[str, list[str]] = {}
        for waiting, other in phase.waits:
            needed.setdefault(waiting, []).append(other)
        for node in phase.nodes:
            name = node.name.value
            after = {numbers[other] for other in needed.get(name, ()) if other in numbers}
            numbers[name] = len(steps) + 1
            steps.append(
                Step(
                    numbers[name],
                    phase.transition,
                    name,
                    node.full_name,
                    causes[name],
                    tuple(sorted(after)),
                )
            )
    return Plan(tuple(steps))


def upward(edges: Iterable[Edge], state: PrimaryState) -> Iterable[tuple[str, str]]:
    """Yield who waits for whom on the way up to ``state``: for those needed in that state."""
    for edge in edges:
        if rank(edge.state) >= rank(state):
            yield edge.node, edge.on


def downward(edges: Iterable[Edge], state: PrimaryState) -> Iterable[tuple[str, str]]:
    """Yield who waits for whom on the way down from ``state``: the needed for those that need."""
    for node, other in upward(edges, state):
        yield other, node


def rank(state: PrimaryState) -> int:
    """Return how far up a state is: unconfigured 0, inactive 1, active 2."""
    return _RANK[state]


def nodes_of(system: System, names: Iterable[str]) -> tuple[Node, ...]:
    """Return the nodes with the given names, in their order."""
    found = (system.node(name) for name in names)
    return tuple(node for node in found if node is not None)


_RANK = {PrimaryState.UNCONFIGURED: 0, PrimaryState.INACTIVE: 1, PrimaryState.ACTIVE: 2}
